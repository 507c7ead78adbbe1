"""The configuration of every command, by its name, with its verb where it has verbs."""

from handrail.scripts.bench.__main__ import BENCHES
from handrail.scripts.commands import COMMANDS

JOBS = {f"handrail-{name}": command.job for name, command in COMMANDS.items() if command.job} | {
    f"handrail-{name} {verb}": job
    for name, command in COMMANDS.items()
    for verb, job in command.verbs.items()
}
CONFIGS = {name: job.config for name, job in JOBS.items()}
BENCH_CONFIGS = {f"bench {name}": bench.settings for name, bench in BENCHES.items()}
