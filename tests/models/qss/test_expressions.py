"""Compiled expressions: their Taylor coefficients against numbers, and what is refused."""

import ast
import math
import random
from collections.abc import Callable
from operator import mul, truediv

import pytest

from firmware_runtime.models.qss.enclosure import RANGES
from firmware_runtime.models.qss.expression import FUNCTIONS, ExpressionError, parse
from firmware_runtime.models.qss.program import (
    Layout,
    Program,
    Quanta,
    compile_allowance,
    compile_bound,
    compile_expression,
)
from firmware_runtime.models.qss.segment import Segment

TEXTS = [
    *(f"{name}(0.3 + 0.2 * x)" for name, (least, _) in FUNCTIONS.items() if least == 1),
    "atan2(y + 0.5, x - 2)",
    "x * y",
    "x / (1 + y * y)",
    "x ** 3 - 2 * x ** 2 + x - 7",
    "x ** -2",
    "(2 + x) ** 2.5",
    "(2 + x) ** y",
    "2 ** x",
    "pow(x, 2)",
    "min(x, y, 2 * x)",
    "max(x * x, y)",
    "x if x > y else -y",
    "exp(-x) * sin(3 * t) / sqrt(1 + t)",
    "log(2 + tanh(x)) ** 2",
    "k * x - (-y) + 3 / k",
    "sinh(x) * cosh(y) - tan(x * y / 4)",
    "(x > 0) * x + (not x > 0 and y > 0) * y",
]


def value_of(text: str) -> Callable[[float, float, float], float]:
    """The expression by Python itself."""
    names = {name: getattr(math, name) for name in FUNCTIONS if hasattr(math, name)}
    names |= {"abs": abs, "min": min, "max": max, "sign": lambda a: math.copysign(1.0, a)}
    code = compile(ast.parse(text, mode="eval"), text, "eval")
    return lambda t, x, y: float(eval(code, {**names, "t": t, "x": x, "y": y, "k": 4.0}))  # noqa: S307


@pytest.mark.parametrize("text", TEXTS)
def test_the_coefficients_are_those_of_the_function_along_its_inputs(text: str) -> None:
    generator = random.Random(text)  # noqa: S311
    x = [generator.uniform(0.2, 0.9) for _ in range(3)]
    y = [generator.uniform(0.2, 0.9) for _ in range(3)]
    t = generator.uniform(0.0, 2.0)
    layout = Layout({"x": 3, "y": 3}, {"k": 4.0})
    program = compile_expression(parse(text), layout, 5)
    sides: list[bool] = []
    for condition in program.conditions:
        sides.append(condition.code(t, sides, [*x, *y])[0] > 0.0)
    coefficients = program.value(t, sides, [*x, *y])
    exact = value_of(text)
    for step in (1e-2, -1e-2, 2e-2):
        at = exact(
            t + step, x[0] + x[1] * step + x[2] * step**2, y[0] + y[1] * step + y[2] * step**2
        )
        series = sum(each * step**power for power, each in enumerate(coefficients))
        assert series == pytest.approx(at, abs=3e-6)
        assert sum(coefficients[:2]) != pytest.approx(coefficients[0]) or text.startswith("sign")


@pytest.mark.parametrize("text", TEXTS)
@pytest.mark.parametrize("power", [1, 2, 3, 4])
def test_a_coefficient_stays_within_its_bound_over_the_whole_stretch(text: str, power: int) -> None:
    generator = random.Random(text)  # noqa: S311
    layout = Layout({"x": 3, "y": 3}, {"k": 4.0})
    tree = parse(text)
    program, bound = compile_expression(tree, layout, 5), compile_bound(tree, layout, power)
    for _ in range(40):
        x, y = ([generator.uniform(-0.9, 0.9) for _ in range(3)] for _ in "xy")
        t, span = generator.uniform(0.0, 2.0), 10.0 ** generator.uniform(-3.0, 0.5)
        try:
            sides = sides_at(program, t, [*x, *y])
            most = bound(t, sides, [*x, *y], span)
        except (ValueError, ArithmeticError):
            continue  # it has no value there
        for share in (0.0, 0.1, 0.35, 0.5, 0.8, 1.0):
            later = [each for a in (x, y) for each in Segment(*a).after(share * span)[:3]]
            try:
                if sides_at(program, t + share * span, later) != sides:
                    break
                coefficient = program.value(t + share * span, sides, later)[power]
            except (ValueError, ArithmeticError):
                assert not most < math.inf
                break
            assert not abs(coefficient) > most * (1.0 + 1e-9) + 1e-12


def test_a_bound_comes_near_the_coefficient_as_the_stretch_shrinks() -> None:
    layout = Layout({"x": 3, "y": 3}, {})
    shapes = ("sin(x) * exp(y)", "x / (2 + y)", "1 / (9 + y)", "sqrt(2 + x)")
    for text in (*shapes, "exp(-((t - 5) / 0.01) ** 2)"):
        tree = parse(text)
        program, bound = compile_expression(tree, layout, 4), compile_bound(tree, layout, 3)
        x, y = [0.3, 1.0, 0.2], [0.1, 0.7, 0.4]
        exact = abs(program.value(1.0, [], [*x, *y])[3])
        assert exact <= bound(1.0, [], [*x, *y], 1e-6) <= 20.0 * exact + 1e-9


@pytest.mark.parametrize(
    ("name", "least", "most"),
    [
        *((name, -4.0, 4.0) for name in ("exp", "sin", "cos", "sinh", "cosh", "tanh", "atan")),
        ("log", 0.01, 4.0),
        ("asin", -1.0, 1.0),
    ],
)
def test_the_range_of_a_function_is_that_of_its_values(
    name: str, least: float, most: float
) -> None:
    generator = random.Random(name)  # noqa: S311
    for _ in range(30):
        low, high = sorted(generator.uniform(least, most) for _ in range(2))
        values = [getattr(math, name)(low + (high - low) * n / 500) for n in range(501)]
        found = RANGES[f"{name}_"](low, high)
        assert found == pytest.approx((min(values), max(values)), abs=1e-3)


@pytest.mark.parametrize(
    ("name", "value", "divisors"),
    [
        ("product_", mul, (-4.0, 4.0)),
        ("quotient_", truediv, (0.1, 4.0)),
        ("quotient_", truediv, (-4.0, -0.1)),
    ],
)
def test_the_range_of_two_arguments_is_that_of_their_values(
    name: str, value: Callable[[float, float], float], divisors: tuple[float, float]
) -> None:
    generator = random.Random(name)  # noqa: S311
    for _ in range(30):
        one, other = (
            sorted(generator.uniform(*each) for _ in range(2)) for each in ((-4.0, 4.0), divisors)
        )
        values = [value(a, b) for a in one for b in other]  # none is beyond those of the ends
        assert RANGES[name](*one, *other) == pytest.approx((min(values), max(values)))


@pytest.mark.parametrize(
    ("ends", "expected"),
    [((-3.0, 2.0), (0.0, 9.0)), ((1.0, 2.0), (1.0, 4.0)), ((-3.0, -0.5), (0.25, 9.0))],
)
def test_the_range_of_a_square_is_never_below_zero(
    ends: tuple[float, float], expected: tuple[float, float]
) -> None:
    assert RANGES["square_"](*ends) == expected


@pytest.mark.parametrize("exponent", [-1.5, 0.5, 2.5])
def test_the_range_of_a_power_is_that_of_its_values(exponent: float) -> None:
    generator = random.Random(exponent)  # noqa: S311
    for _ in range(30):
        ends = sorted(generator.uniform(0.1, 4.0) for _ in range(2))
        expected = sorted(each**exponent for each in ends)
        assert RANGES["power_"](*ends, exponent) == pytest.approx(tuple(expected))


@pytest.mark.parametrize(("ends", "most"), [((0.5, 3.0), 2.0), ((-3.0, -0.25), 4.0)])
def test_a_reciprocal_is_bounded_by_that_of_the_end_next_to_zero(
    ends: tuple[float, float], most: float
) -> None:
    assert RANGES["inverse_"](*ends) == most


@pytest.mark.parametrize("ends", [(-1.0, 2.0), (0.0, 2.0), (-2.0, 0.0)])
def test_what_may_pass_zero_has_no_bound_as_a_divisor(ends: tuple[float, float]) -> None:
    assert RANGES["inverse_"](*ends) == math.inf
    assert RANGES["quotient_"](1.0, 1.0, *ends) == (-math.inf, math.inf)
    if ends[0] < 0.0:
        assert RANGES["power_"](*ends, 0.5) == (-math.inf, math.inf)


def sides_at(program: Program, t: float, flat: list[float]) -> list[bool]:
    sides: list[bool] = []
    for condition in program.conditions:
        sides.append(condition.code(t, sides, flat)[0] > 0.0)
    return sides


@pytest.mark.parametrize(
    "text", ["3 * x - y / 4", "k * x", "x if y > 0 else 2 * x", "x - sin(0.5)", "m * x", "t + x"]
)
def test_what_is_linear_is_known_to_be(text: str) -> None:
    layout = Layout({"x": 3, "y": 3, "m": 1}, {"k": 4.0})
    assert compile_expression(parse(text), layout, 3).degree <= 2


@pytest.mark.parametrize("text", ["x * y", "sin(x)", "1 / x", "x ** 2", "sqrt(t)", "abs(x) * x"])
def test_what_is_not_linear_is_not_taken_for_it(text: str) -> None:
    assert compile_expression(parse(text), Layout({"x": 3, "y": 3}, {}), 3).degree > 2


def test_the_allowance_is_a_quarter_of_what_the_quanta_of_the_inputs_cause() -> None:
    tree, layout = parse("3 * x - y * x"), Layout({"x": 2, "y": 2}, {})
    quanta = Quanta({"x": (0.1, 0.0), "y": (0.01, 0.5)}, least=1e-9)
    (allowed,) = compile_allowance(tree, layout, quanta)(0.0, [], [2.0, 0.0, -4.0, 0.0])
    assert allowed == pytest.approx(0.25 * (0.1 * abs(3.0 + 4.0) + 2.0 * 2.0))


@pytest.mark.parametrize(
    "text",
    [
        "",
        "x +",
        "x; y",
        "__import__('os').system('true')",
        "x.real",
        "x[0]",
        "lambda: 0",
        "[x for x in y]",
        "'text'",
        "1j",
        "x % 2",
        "x // 2",
        "~x",
        "sin(x, y)",
        "exp(x, y)",
        "sign(x, y)",
        "sin()",
        "sin(x=1)",
        "foo(x)",
        "(sin)(*x)",
        "x in y",
        "x := 1",
        "1e999",
        "(" * 500 + "x" + ")" * 500,
        "-" * 20_000 + "x",
    ],
)
def test_anything_but_arithmetic_is_refused_with_a_sentence(text: str) -> None:
    with pytest.raises(ExpressionError) as caught:
        compile_expression(parse(text), Layout({"x": 2, "y": 2}, {}), 3)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("text", ["z", "x + zeta", "x == y", "1 / 0", "log(0)", "3 if x else 4"])
def test_what_cannot_be_compiled_is_refused_too(text: str) -> None:
    with pytest.raises(ExpressionError):
        compile_expression(parse(text), Layout({"x": 2, "y": 2}, {}), 3)
