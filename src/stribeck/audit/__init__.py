"""Checks of a log before friction is fitted: each check is a function from evidence to findings."""

from stribeck.audit.audit import audit as audit
from stribeck.audit.audit import audit_or_stop as audit_or_stop
from stribeck.audit.audit import findings as findings
from stribeck.audit.audit import model_findings as model_findings
from stribeck.audit.audit import reconciled as reconciled
from stribeck.audit.audit import without_dead_joints as without_dead_joints
from stribeck.audit.delay import delays as delays
from stribeck.audit.evidence import AuditData as AuditData
from stribeck.audit.evidence import gather as gather
