"""How long the stress tests run.

By default the random scenes are 50 and hypothesis tries few examples: seconds. The long run,

    STRESS_SCENES=1000 python -m pytest tests/stress

tries that many scenes, and as many examples in proportion. Both are deterministic.
"""

import os

from hypothesis import Phase, settings

SCENES = int(os.environ.get("STRESS_SCENES", "50"))
# scenes that an earlier renderer got wrong
HARD = (257, 1035)

settings.register_profile(
    "stress",
    derandomize=True,
    deadline=None,
    database=None,
    max_examples=max(SCENES // 6, 5),
    # a failing example names its scene's seed: a smaller seed is no simpler scene
    phases=(Phase.explicit, Phase.generate),
)
settings.load_profile("stress")


def pytest_generate_tests(metafunc):
    if "scene_seed" in metafunc.fixturenames:
        metafunc.parametrize("scene_seed", sorted({*range(SCENES), *HARD}))
