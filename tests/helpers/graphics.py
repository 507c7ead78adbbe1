"""Whether pictures can be drawn here; tried once."""

import functools

from handrail.collect.world import gl

graphics_trouble = functools.cache(gl.graphics_trouble)
