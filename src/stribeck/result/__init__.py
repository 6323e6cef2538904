"""Results of `identify`: content, storage, comparison and provenance."""

from stribeck.result.estimates import CurvePoint as CurvePoint
from stribeck.result.estimates import ParameterEstimate as ParameterEstimate
from stribeck.result.estimates import TermDecision as TermDecision
from stribeck.result.estimates import TermVerdict as TermVerdict
from stribeck.result.estimates import TorqueR2 as TorqueR2
from stribeck.result.estimates import Validation as Validation
from stribeck.result.estimates import Verdict as Verdict
from stribeck.result.joint import CouplingResult as CouplingResult
from stribeck.result.joint import JointResult as JointResult
from stribeck.result.law_values import at_load as at_load
from stribeck.result.law_values import law_slopes as law_slopes
from stribeck.result.law_values import law_values as law_values
from stribeck.result.parts import BODY_COORDINATES as BODY_COORDINATES
from stribeck.result.parts import BodyCorrection as BodyCorrection
from stribeck.result.parts import Corrections as Corrections
from stribeck.result.parts import ErrorCorrelation as ErrorCorrelation
from stribeck.result.parts import Evidence as Evidence
from stribeck.result.parts import HeldOutError as HeldOutError
from stribeck.result.parts import HeldOutLog as HeldOutLog
from stribeck.result.plot import velocity_grid as velocity_grid
from stribeck.result.result import SCHEMA as SCHEMA
from stribeck.result.result import LogSummary as LogSummary
from stribeck.result.result import Result as Result
from stribeck.result.result import read_result as read_result
