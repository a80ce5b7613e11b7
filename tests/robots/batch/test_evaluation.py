"""Both evaluators, on arrays of samples."""

from __future__ import annotations

import casadi
import numpy as np
import pytest

from robots.batch import batch_function
from robots.common.errors import InputError
from robots.regressor import default_model

# The two differ by how libm, numpy and fused multiply-adds round: some 1e-16 an operation.
ACCURACY = 1e-12


@pytest.fixture(params=["compiled", "vectorised"])
def backend(request):
    if request.param == "compiled":
        request.getfixturevalue("needs_compiler")
    return request.param


@pytest.mark.parametrize("samples", [1, 2, 7, 8, 9, 17, 2047, 2048, 2049])
def test_any_number_of_samples(samples, backend, function, expected):
    """Every sample is evaluated as CasADi does it, at the borders of blocks and chunks too."""
    x, y = (np.random.default_rng(samples).normal(size=(samples, k)) for k in (3, 2))
    first, second = batch_function(function, backend)(x, y)
    assert (first.shape, second.shape) == ((samples, 2, 3), (samples, 2, 1))
    few = slice(max(0, samples - 20), None)  # CasADi's own call is slow
    for ours, theirs in zip((first, second), expected(x[few], y[few]), strict=True):
        np.testing.assert_allclose(ours[few], theirs, rtol=ACCURACY, atol=ACCURACY)
    alone = batch_function(function, backend)(x[:1], y[:1])[0]
    np.testing.assert_allclose(alone, first[:1], rtol=ACCURACY, atol=ACCURACY)


def test_no_sample(backend, function):
    """No sample gives empty arrays of the right shape."""
    assert batch_function(function, backend)(np.zeros((0, 3)), np.zeros((0, 2)))[0].shape == (0, 2, 3)


def test_out_is_written_whole(backend, function):
    """Arrays given as `out` are filled, structural zeros included, and returned."""
    evaluate = batch_function(function, backend)
    x, y = np.random.default_rng(0).normal(size=(3, 11)), np.random.default_rng(1).normal(size=(2, 11))
    x, y = x.T, y.T  # not C-ordered
    fresh = evaluate(x, y)
    kept = tuple(np.full_like(array, np.nan) for array in fresh)
    returned = evaluate(x, y, out=kept)
    assert all(a is b for a, b in zip(returned, kept, strict=True))
    for a, b in zip(fresh, kept, strict=True):
        np.testing.assert_array_equal(a, b)


def test_whole_numbers_and_split_axes_are_accepted(backend, function):
    """Arguments may hold integers, and may split their numbers over several axes."""
    evaluate = batch_function(function, backend)
    x, y = np.arange(12).reshape(4, 3), np.ones((4, 2))
    np.testing.assert_array_equal(evaluate(x, y)[0], evaluate(x.reshape(4, 1, 3) * 1.0, y)[0])


@pytest.mark.parametrize(
    ("shapes", "message"),
    [
        ([(4, 3), (5, 2)], r"argument 2 has shape \(5, 2\); allowed: \(4, 2\)"),
        ([(4, 2), (4, 2)], r"argument 1 has shape \(4, 2\); allowed: \(4, 3\)"),
        ([(4, 3)], "1 arguments; allowed: 2"),
    ],
)
def test_arguments_of_a_wrong_shape_are_refused(shapes, message, backend, function):
    """A wrong shape, or number of arguments, is refused with the shape that is allowed."""
    with pytest.raises(InputError, match=message):
        batch_function(function, backend)(*(np.zeros(shape) for shape in shapes))


def test_out_of_a_wrong_shape_is_refused(backend, function):
    """`out` must have the shape, type and order of the result, for it is written as raw memory."""
    evaluate = batch_function(function, backend)
    arguments, second = (np.zeros((4, 3)), np.zeros((4, 2))), np.zeros((4, 2, 1))
    wrong = np.zeros((3, 2, 3)), np.zeros((4, 2, 3), dtype=np.float32), np.zeros((3, 2, 4)).T
    for first in wrong:
        with pytest.raises(InputError, match=r"allowed: \(4, 2, 3\), C-ordered float64"):
            evaluate(*arguments, out=(first, second))
    with pytest.raises(InputError, match="1 arrays in out; allowed: 2"):
        evaluate(*arguments, out=(second,))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["er3a", "ur10", "panda"])
def test_both_evaluators_agree(name, catalogue_robot, states, needs_compiler):
    """Compiled and vectorised regressors and their adjoints agree to 1e-12 of their largest value."""
    model = default_model(catalogue_robot(name), velocity_scale=0.02)
    for function in (model.symbolic(), model.adjoint()):
        arguments = [*states(model.robot, 100)]
        if function.n_in() == 4:
            arguments.append(np.random.default_rng(1).normal(size=(100, function.numel_in(3))))
        pairs = zip(*(batch_function(function, b)(*arguments) for b in ("compiled", "vectorised")), strict=True)
        for a, b in pairs:
            np.testing.assert_allclose(a, b, rtol=0, atol=ACCURACY * np.abs(b).max())


def test_constants_and_copies(backend):
    """A function may return its input, and constants that are infinite or no number."""
    x = casadi.SX.sym("x", 2)
    evaluate = batch_function(casadi.Function("f", [x], [x, casadi.SX([np.inf, -np.inf, np.nan, -0.5])]), backend)
    copied, constants = evaluate(np.array([[1.0, 2.0], [3.0, 4.0]]))
    np.testing.assert_array_equal(copied[:, :, 0], [[1.0, 2.0], [3.0, 4.0]])
    np.testing.assert_array_equal(constants[1, :, 0], [np.inf, -np.inf, np.nan, -0.5])


@pytest.mark.parametrize(("samples", "size"), [(1, 1), (9, 1), (40, 5), (43, 5), (4100, 3), (2100, 2050), (3, 5)])
def test_sums_over_groups(samples, size, backend, function):
    """Sums of each group are those of its samples, and what does not fill a group is left out."""
    evaluate = batch_function(function, backend)
    x, y = (np.random.default_rng(samples).normal(size=(samples, k)) for k in (3, 2))
    groups = samples // size
    for sums, values in zip(evaluate.sums(x, y, size=size), evaluate(x, y), strict=True):
        expected = values[: groups * size].reshape(groups, size, *values.shape[1:]).sum(axis=1)
        np.testing.assert_allclose(sums, expected, rtol=ACCURACY, atol=ACCURACY * size)
