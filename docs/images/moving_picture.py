"""Makes the README's moving picture from a film of `handrail-replay --video`: every fifth picture, cut out.

python docs/images/moving_picture.py outputs/episode_0.mp4 docs/images/pick_place.webp
"""

import sys
from itertools import islice

import av

STEP = 5  # of 20 pictures a second, shown 10 a second: 2.5 times as fast
CUT = (50, 50, 610, 400)  # left, top, right, bottom of what is shown [px]


def main(film: str, target: str) -> None:
    """Write the moving picture, and say how large it is."""
    with av.open(film) as container:
        chosen = islice(container.decode(video=0), 0, None, STEP)
        first, *others = [frame.to_image().crop(CUT) for frame in chosen]
    first.save(target, save_all=True, append_images=others, duration=100, loop=0, quality=45, method=6)
    print(f"{target}: {1 + len(others)} pictures of {first.width} × {first.height}")


if __name__ == "__main__":
    main(*sys.argv[1:])
