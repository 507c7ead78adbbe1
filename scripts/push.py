"""`handrail-push`: write a dataset's card, say what would be sent to the hub, and send it when asked."""

from handrail.collect.commands.config import PushConfig
from handrail.scripts import cli


@cli.command("handrail-push", PushConfig)
def main(config: PushConfig) -> None:
    """Run the command."""
    config.check()
    from handrail.datasets.sharing.push import prepare, upload

    dataset = config.dataset
    push = prepare(dataset.folder, dataset.repo_id, config.license, config.private, config.verify)
    print(push)
    if config.upload:
        upload(push)
        print(f"sent as {push.repo_id}")
    else:
        print("nothing was sent; --upload sends it")


if __name__ == "__main__":
    main()
