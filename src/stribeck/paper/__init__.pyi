from .lugre import LuGre as LuGre
from .observer import MomentumObserver as MomentumObserver
