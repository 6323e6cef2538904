"""What was found, and how it is kept, compared and traced back."""

from stribeck.result.result import SCHEMA as SCHEMA
from stribeck.result.result import BodyCorrection as BodyCorrection
from stribeck.result.result import Corrections as Corrections
from stribeck.result.result import Evidence as Evidence
from stribeck.result.result import JointResult as JointResult
from stribeck.result.result import LogSummary as LogSummary
from stribeck.result.result import ParameterEstimate as ParameterEstimate
from stribeck.result.result import Result as Result
from stribeck.result.result import TermDecision as TermDecision
from stribeck.result.result import TermVerdict as TermVerdict
from stribeck.result.result import Validation as Validation
from stribeck.result.result import Verdict as Verdict
from stribeck.result.result import at_load as at_load
from stribeck.result.result import law_values as law_values
from stribeck.result.result import read_result as read_result
