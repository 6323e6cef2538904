"""Standing feet over time: from contact flags, foot forces or kinematics."""

from stribeck.contact.find import find_support_phases as find_support_phases
from stribeck.contact.phases import SupportPhase as SupportPhase
from stribeck.contact.phases import SupportPhases as SupportPhases
