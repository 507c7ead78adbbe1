"""`handrail-push`: write a dataset's card, say what would be sent, and send it when asked."""

from handrail.collect.commands.config import PushConfig
from handrail.scripts import cli


@cli.command("handrail-push", PushConfig)
def main(config: PushConfig) -> None:
    """Run the command."""
    config.check()
    from handrail.datasets.editing.pack_config import packing_advice
    from handrail.datasets.editing.push import prepare, upload
    from handrail.datasets.editing.store import copy
    from handrail.datasets.presentation.terminal import Terminal

    dataset = config.dataset
    settings = config.license, config.private, config.verify, config.to
    push = prepare(dataset.folder, dataset.repo_id, *settings)
    say = Terminal().print
    say(str(push))
    if advice := packing_advice(dataset.folder):
        say(advice)
    if config.upload:
        send = copy if config.to else upload
        send(push)
        say(f"sent to {config.to}" if config.to else f"sent as {push.repo_id}")
    else:
        say("nothing was sent; --upload sends it")


if __name__ == "__main__":
    main()
