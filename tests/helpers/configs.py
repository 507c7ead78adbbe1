"""The configuration of every command."""

from handrail.collect.commands.config import DemoConfig, InspectConfig, PushConfig, RepairConfig, ReplayConfig
from handrail.collect.config import DriveConfig, RecordConfig
from handrail.collect.lekiwi.host_config import HostConfig
from handrail.collect.teleop_config import CalibrateConfig
from handrail.collect.user_study.config import StudySessionConfig
from handrail.datasets.comparison.config import CompareConfig
from handrail.datasets.editing.config import EditConfig
from handrail.datasets.editing.pack_config import MergeConfig, PackConfig
from handrail.policies.imitation.config import TrainConfig
from handrail.policies.imitation.evaluation.config import EvaluateConfig
from handrail.policies.study.config import StudyConfig
from handrail.scripts.bench.__main__ import BENCHES

CONFIGS = {
    "handrail-record": RecordConfig,
    "handrail-cockpit": DriveConfig,
    "handrail-calibrate": CalibrateConfig,
    "handrail-lekiwi-host": HostConfig,
    "handrail-replay": ReplayConfig,
    "handrail-inspect": InspectConfig,
    "handrail-repair": RepairConfig,
    "handrail-edit": EditConfig,
    "handrail-pack": PackConfig,
    "handrail-merge": MergeConfig,
    "handrail-push": PushConfig,
    "handrail-demo": DemoConfig,
    "handrail-train": TrainConfig,
    "handrail-compare": CompareConfig,
    "handrail-evaluate": EvaluateConfig,
    "handrail-study": StudyConfig,
    "handrail-study-session": StudySessionConfig,
}
BENCH_CONFIGS = {f"bench {name}": bench.settings for name, bench in BENCHES.items()}
