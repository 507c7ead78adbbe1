"""The demo: a few demonstrations, a table, a picture, and what to try next."""

from pathlib import Path

from rich.console import Console

from handrail.collect.config import DatasetConfig, DemoConfig, RecordConfig
from handrail.collect.contact_sheet import save_sheet
from handrail.collect.gl import graphics_trouble
from handrail.collect.record import record
from handrail.collect.replay import replay_episode
from handrail.collect.tables import summary_table
from handrail.controllers.errors import HandrailError

_REPO = "handrail/demo"
_NEXT = """Next:
  handrail-inspect --dataset.root {root}
  handrail-replay  --dataset.root {root}
  handrail-record  --dataset.root {root} --resume --dataset.num_episodes 5 --mode switching{cameras}
  lerobot-dataset-viz --repo-id {repo} --root {root} --episode-index 0    (pip install 'handrail[display]')
  handrail-record --help"""


def demo(config: DemoConfig) -> int:
    """Record, then print a table, the dataset's path, a picture's path, and commands to try.

    Raises:
        HandrailError: a setting is wrong, or the folder is taken.
    """
    console = Console()
    if config.episodes < 1:
        raise HandrailError(f"--episodes {config.episodes}: expected 1 or more")
    trouble = graphics_trouble()
    if trouble:
        console.print(f"Without pictures: {trouble}", highlight=False, soft_wrap=True)
    cameras = "" if trouble else "wrist,scene"
    root = Path(config.root) / "dataset"
    dataset = DatasetConfig(repo_id=_REPO, root=str(root), num_episodes=config.episodes)
    console.print(f"Recording {config.episodes} episodes: the operator steers the hand, the MPC the rest …")
    code = record(RecordConfig(dataset=dataset, cameras=cameras, overwrite=config.overwrite))
    if code:
        return code
    console.print(summary_table(root))
    if not trouble:
        sheet = Path(config.root) / "episode_0.png"
        save_sheet(replay_episode(root, 0, pictures=8)[1], sheet)
        console.print(f"Picture: {sheet}", highlight=False, soft_wrap=True)
    console.print(f"Dataset: {root}", highlight=False, soft_wrap=True)
    flags = f" --cameras {cameras}" if cameras else ""
    console.print(_NEXT.format(root=root, repo=_REPO, cameras=flags), highlight=False, soft_wrap=True)
    return 0
