# For pyright only. casadi: its generated types are wrong about its own overloads: everything in it is Any.
from typing import Any

def __getattr__(name: str) -> Any: ...
