"""How colcon builds the package; the node itself comes with firmware-runtime."""

from setuptools import setup

NAME = "firmware_runtime_ros2"

setup(
    name=NAME,
    version="0.1.0",
    packages=[NAME],
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
        (f"share/{NAME}/launch", ["launch/robot.launch.py"]),
    ],
    install_requires=["setuptools"],
    zip_safe=True,
    maintainer="the firmware-runtime maintainers",
    maintainer_email="maintainers@firmware-runtime.invalid",
    description="Starts the lifecycle node of a robot that firmware-runtime runs",
    license="MIT",
    entry_points={"console_scripts": [f"robot = {NAME}.robot:main"]},
)
