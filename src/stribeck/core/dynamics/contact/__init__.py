"""Standing feet over time: from contact flags, foot forces or kinematics."""

from stribeck.core.dynamics.contact.find import find_support_phases as find_support_phases
from stribeck.core.dynamics.contact.phases import SupportPhase as SupportPhase
from stribeck.core.dynamics.contact.phases import SupportPhases as SupportPhases
