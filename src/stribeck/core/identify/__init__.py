"""From logs to a result: methods, and the stages before and after them."""

from stribeck.core.identify.contract import Fitted as Fitted
from stribeck.core.identify.contract import Method as Method
from stribeck.core.identify.methods import METHODS as METHODS
from stribeck.core.identify.methods import get_method as get_method
from stribeck.core.identify.pipeline import identify as identify
