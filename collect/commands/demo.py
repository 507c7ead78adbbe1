"""The demo: a few demonstrations, a table, a picture, and what to try next."""

import shlex

from handrail.collect.commands.account import command_prefix
from handrail.collect.commands.config import DemoConfig
from handrail.collect.commands.record import record
from handrail.collect.commands.replay import replay_episode
from handrail.collect.commands.tables import summary_table
from handrail.collect.config import REPO_ID, DatasetConfig, RecordConfig
from handrail.collect.session.film import save_sheet
from handrail.collect.world.gl import graphics_trouble
from handrail.controllers.errors import HandrailError
from handrail.datasets.format.layout import Layout
from handrail.datasets.presentation.terminal import Terminal
from handrail.datasets.reading.reader import read_info
from handrail.datasets.recording.folder import is_dataset

NEXT = """Next:
  {bin}handrail-cockpit
  {bin}handrail-inspect {root}
  {bin}handrail-replay {root}
  {bin}handrail-record {root} --resume --dataset.num_episodes 5 --mode switching{cameras}
  {bin}lerobot-dataset-viz --repo-id {repo} --root {root} --episode-index 0 \
--save 1 --output-dir {folder}
  {bin}handrail-record --help
lerobot-dataset-viz needs the extra display, and without --save a screen."""


def demo(config: DemoConfig) -> int:
    """Record, then print a table, the dataset's path, a picture's path, and commands to try."""
    console = Terminal()
    if config.episodes < 1:
        raise HandrailError(f"--episodes {config.episodes}: expected 1 or more")
    trouble = graphics_trouble()
    if trouble:
        console.print(f"Without pictures: {trouble}")
    cameras = "" if trouble else "wrist,scene"
    root = config.folder / "dataset"
    if is_dataset(Layout(root)) and not config.overwrite:
        raise HandrailError(f"{root}: an earlier demo is there; say --overwrite, or choose another folder")
    if is_dataset(Layout(root)) and (found := read_info(root).episodes) > config.episodes:
        raise HandrailError(f"{root}: has {found} episodes, not {config.episodes}; choose another folder")
    dataset = DatasetConfig(repo_id=REPO_ID, root=str(root), num_episodes=config.episodes)
    console.print(f"Recording {config.episodes} episodes: the operator steers the hand, the MPC the rest …")
    code = record(RecordConfig(dataset=dataset, cameras=cameras, overwrite=config.overwrite))
    if code:
        return code
    console.print(summary_table(root))
    if not trouble:
        sheet = config.folder / "episode_0.png"
        save_sheet(replay_episode(root, 0, pictures=8)[1], sheet)
        console.print(f"Picture: {sheet}")
    console.print(f"Dataset: {root}")
    flags = f" --cameras {cameras}" if cameras else ""
    paths = {"root": shlex.quote(str(root)), "folder": shlex.quote(str(config.folder))}
    after = NEXT.format(**paths, repo=REPO_ID, cameras=flags, bin=command_prefix())
    console.print(*after.splitlines(), sep="\n")
    return 0
