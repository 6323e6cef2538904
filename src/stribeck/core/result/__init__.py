"""Results of `identify`: content, storage, comparison and provenance."""

from stribeck.core.result.estimates import CurvePoint as CurvePoint
from stribeck.core.result.estimates import ParameterEstimate as ParameterEstimate
from stribeck.core.result.estimates import TermDecision as TermDecision
from stribeck.core.result.estimates import TermVerdict as TermVerdict
from stribeck.core.result.estimates import TorqueR2 as TorqueR2
from stribeck.core.result.estimates import Validation as Validation
from stribeck.core.result.estimates import Verdict as Verdict
from stribeck.core.result.joint import CouplingResult as CouplingResult
from stribeck.core.result.joint import JointResult as JointResult
from stribeck.core.result.law_values import at_load as at_load
from stribeck.core.result.law_values import law_slopes as law_slopes
from stribeck.core.result.law_values import law_values as law_values
from stribeck.core.result.law_values import velocity_grid as velocity_grid
from stribeck.core.result.parts import BODY_COORDINATES as BODY_COORDINATES
from stribeck.core.result.parts import BodyCorrection as BodyCorrection
from stribeck.core.result.parts import Corrections as Corrections
from stribeck.core.result.parts import ErrorCorrelation as ErrorCorrelation
from stribeck.core.result.parts import Evidence as Evidence
from stribeck.core.result.parts import HeldOutError as HeldOutError
from stribeck.core.result.parts import HeldOutLog as HeldOutLog
from stribeck.core.result.result import SCHEMA as SCHEMA
from stribeck.core.result.result import LogSummary as LogSummary
from stribeck.core.result.result import Result as Result
from stribeck.core.result.result import read_result as read_result
