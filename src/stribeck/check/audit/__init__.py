"""Checks of a log before friction is fitted: each check is a function from evidence to findings."""

from stribeck.check.audit.audit import audit as audit
from stribeck.check.audit.audit import audit_or_stop as audit_or_stop
from stribeck.check.audit.audit import findings as findings
from stribeck.check.audit.delay import delays as delays
from stribeck.check.audit.evidence import AuditData as AuditData
from stribeck.check.audit.evidence import gather as gather
