"""`python -m benchmarks.qss`: the same as `firmware-runtime bench qss`."""

import argparse
import sys

from benchmarks.qss import bench

parser = argparse.ArgumentParser(prog="benchmarks.qss", description=bench.SUMMARY)
bench.add_options(parser)
sys.exit(bench.execute(parser.parse_args()))
