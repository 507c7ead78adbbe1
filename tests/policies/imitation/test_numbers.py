"""The weights and statistics of a checkpoint: its policy's own and finite, or one line."""

import numpy as np
import pytest
from safetensors.numpy import load_file, save_file
from training_helpers import cut

from handrail.controllers.errors import HandrailError
from handrail.policies.imitation.evaluation.config import EvaluateConfig
from handrail.policies.imitation.evaluation.evaluation import evaluate
from handrail.policies.imitation.interface.checkpoint import model_folder
from handrail.policies.imitation.interface.trained import load_policy
from handrail.policies.imitation.training.training import train

pytestmark = pytest.mark.filterwarnings("ignore:.*(torchcodec|pin_memory|video).*")


def spoil(file, how):
    """Give one array of a safetensors file another name or a NaN, or leave it out."""
    arrays = {name: values.copy() for name, values in load_file(file).items()}
    name = "model.action_head.weight" if "model.action_head.weight" in arrays else "observation.state.mean"
    values = arrays[name]
    if how in ("foreign", "missing"):
        gone = {key for key in arrays if key.startswith(name.removesuffix("mean"))}
        arrays = {key: each for key, each in arrays.items() if key not in gone}
    if how == "foreign":
        arrays["stranger.mean"] = values
    if how == "nan":
        values.flat[0] = np.nan
    if how == "endless":
        values.flat[0] = np.inf
    save_file(arrays, file)


@pytest.mark.parametrize("how", ["foreign", "missing", "nan", "endless"])
@pytest.mark.parametrize("file", ["model", "policy_preprocessor_*_normalizer_processor"])
def test_weights_and_statistics_are_the_policy_s_and_finite(file, how, trained, tmp_path):
    """Law: a policy that would drive at random is refused, to be evaluated and to learn on."""
    config = cut(trained[1], tmp_path / "training")
    place = model_folder(config.folder)
    (spoilt,) = place.glob(f"{file}.safetensors")
    assert load_policy(place).meta
    spoil(spoilt, how)
    once = EvaluateConfig(policy=(str(place),), episodes=1, workers=1)
    for use in (lambda: load_policy(place), lambda: evaluate(once), lambda: train(config, quiet=True)):
        with pytest.raises(HandrailError, match=r"policy '.*training") as raised:
            use()
        assert "\n" not in str(raised.value)
