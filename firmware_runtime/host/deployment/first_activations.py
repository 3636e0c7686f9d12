"""The first activations of a robot that was deployed, by its statistics."""

from time import monotonic, sleep

from firmware_runtime.host.deployment.deployment import Deployment, DeploymentOptions
from firmware_runtime.statistics.figures import Figures, figures_of

TIMEOUT_S = 30.0
"""How long the first activations may take after systemd has started the robot."""
LOOK_S = 1.0


def first_figures(options: DeploymentOptions, deployment: Deployment) -> Figures | None:
    """Return the figures of a robot that has begun; None where it has not within half a minute."""
    program = f"{options.home}/venv/bin/firmware-runtime"
    give_up_at = monotonic() + TIMEOUT_S
    while True:
        ended = deployment.connection.command(program, "stats", deployment.board, "--json")
        if ended.status == 0:
            figures = figures_of(ended.out, options.host)
            if figures.conditions.run.state == "running" and figures.has_begun:
                return figures
        if monotonic() > give_up_at:
            return None
        sleep(LOOK_S)
