"""The couplings of Figure 1, and the classes that a model file may name."""

from typing import Final

from firmware_runtime import AtomicClass, Coupled
from generator_buffer_processor.buffer import Buffer
from generator_buffer_processor.generator import Generator
from generator_buffer_processor.processor import Processor

ATOMIC_CLASSES: Final = {
    "Generator": AtomicClass(Generator, times={"period": "period"}),
    "Buffer": AtomicClass(Buffer, times={"preparation": "preparation"}),
    "Processor": AtomicClass(Processor, times={"processing": "processing"}),
}
"""What a model file may name once this package is installed."""


class BufProc(Coupled):
    """BUF-PROC: BUF keeps jobs for PROC, which says by `out` that it is done."""

    def __init__(self, name: str = "BUF-PROC") -> None:
        super().__init__(name)
        self.entrance = self.in_port("in", int)
        self.out = self.out_port("out", int)
        buf = self.add(Buffer("BUF"))
        proc = self.add(Processor("PROC"))

        self.couple(self.entrance, buf.entrance)
        self.couple(buf.out, proc.entrance)
        self.couple(proc.out, buf.done)
        self.couple(proc.out, self.out)


class Top(Coupled):
    """Generator and BUF-PROC; `in` switches the generator, `out` has the jobs that are done."""

    def __init__(self, name: str = "top") -> None:
        super().__init__(name)
        self.switch = self.in_port("in", float)
        self.out = self.out_port("out", int)
        generator = self.add(Generator("Generator"))
        buf_proc = self.add(BufProc("BUF-PROC"))

        self.couple(self.switch, generator.switch)
        self.couple(generator.out, buf_proc.entrance)
        self.couple(buf_proc.out, self.out)
