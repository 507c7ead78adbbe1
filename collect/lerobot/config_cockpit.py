"""Settings of the teleoperator `handrail_cockpit`."""

from dataclasses import dataclass

from lerobot.teleoperators import TeleoperatorConfig

from handrail.collect.cockpit_config import CockpitConfig


@TeleoperatorConfig.register_subclass("handrail_cockpit")
@dataclass(kw_only=True)
class HandrailCockpitConfig(TeleoperatorConfig):
    """A person at a browser steers `handrail_sim`. The names are those of `--cockpit` of `handrail-record`.

    Attributes:
        host: address to listen at; any other than 127.0.0.1 asks for a token, by HTTPS.
        token: whether to ask for the token on 127.0.0.1 too; without, every account here can drive.
        port: to listen at; the next free one where it is taken; 0 for any.
        open: whether to open the page in this computer's browser, unless it asks for a token.
        certificate: folder of a certificate of your own, cert.pem and key.pem.
    """

    host: str = CockpitConfig.host
    token: bool = False
    port: int = CockpitConfig.port
    open: bool = True
    certificate: str = ""

    def cockpit(self) -> CockpitConfig:
        """Return where the cockpit listens."""
        config = CockpitConfig(self.host, self.token, self.port, self.open, self.certificate)
        config.check()
        return config
