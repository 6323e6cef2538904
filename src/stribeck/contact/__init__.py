"""Which feet stand, when: from flags, from foot forces, or from kinematics when a log has neither."""

from stribeck.contact.find import find_support_phases as find_support_phases
from stribeck.contact.phases import SupportPhase as SupportPhase
from stribeck.contact.phases import SupportPhases as SupportPhases
