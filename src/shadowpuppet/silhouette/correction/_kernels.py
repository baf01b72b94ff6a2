"""Kernels: points compared with a reduced picture, one by one and for many shifts; pictures moved back; gains of light, and their
removal; lost detail restored."""

from __future__ import annotations

import numpy as np

from shadowpuppet.jit import compiled, device, kernel, reduction_kernel


@compiled(nogil=True)
def point_differences(xy, value, picture, movement, outside, out):
    """Differences (N,) of the picture (H, W) at the moved points and the points' values; `outside` for points outside the picture."""
    height, width = picture.shape
    half = np.float32(width / 2)
    for n in range(len(value)):
        u, v = xy[n, 0], xy[n, 1]
        w = movement[2, 0] * u + movement[2, 1] * v + movement[2, 2]
        x = ((movement[0, 0] * u + movement[0, 1] * v + movement[0, 2]) / w + 1) * half - np.float32(0.5)
        y = (movement[1, 0] * u + movement[1, 1] * v + movement[1, 2]) / w * half + np.float32(height / 2 - 0.5)
        if not (0 <= x < width - 1 and 0 <= y < height - 1):
            out[n] = outside
            continue
        i, j = int(y), int(x)
        q, p = y - np.float32(i), x - np.float32(j)
        above = picture[i, j] + p * (picture[i, j + 1] - picture[i, j])
        below = picture[i + 1, j] + p * (picture[i + 1, j + 1] - picture[i + 1, j])
        out[n] = above + q * (below - above) - value[n]


@reduction_kernel
def shift_costs(x, y, value, padded, inside, cap, costs, numbers):
    """Mean difference, capped, of points and a picture, in `costs` (2 R + 1, 2 R + 1), for shifts by up to R pixels down and across.

    x, y: columns and rows (N,) of the points; value: theirs (N,); padded: the picture with R more rows and columns at each side,
    (H + 2 R, W + 2 R), and `inside`, 1 in the picture and 0 beside it, both float32; numbers: work space, like `costs`.
    """
    side = costs.shape[0]
    costs[:], numbers[:] = 0, 0
    for n in range(len(value)):
        level, left = value[n], x[n]
        for dy in range(side):
            row, there, cost, number = padded[y[n] + dy, left : left + side], inside[y[n] + dy, left : left + side], costs[dy], numbers[dy]
            for dx in range(side):
                cost[dx] += there[dx] * min(abs(row[dx] - level), cap)
                number[dx] += there[dx]
    for dy in range(side):
        for dx in range(side):
            costs[dy, dx] /= max(numbers[dy, dx], np.float32(1))


@reduction_kernel
def normal_equations(jacobian, difference, scale, left, right):
    """Fill `left` (K, K) and `right` (K,) with the normal equations of a step that takes differences (N,) away, which have the derivatives
    `jacobian` (N, K); in units of their standard deviation `scale`, with the weights of Geman and McClure."""
    left[:], right[:] = 0, 0
    parameters = jacobian.shape[1]
    for n in range(len(difference)):
        far = difference[n] / (2 * scale)
        root = 1 / ((1 + far * far) * scale)
        for k in range(parameters):
            part = root * root * jacobian[n, k]
            right[k] += part * difference[n]
            for m in range(k + 1):
                left[k, m] += part * jacobian[n, m]
    for k in range(parameters):
        for m in range(k):
            left[m, k] = left[k, m]


@reduction_kernel
def moved_back(image, matrix, channels, ramp, out):
    """Fill `out`, like `image` (H, W * C) of uint8, with the picture that it is at places moved by `matrix` (3, 3), from pixels of `out` to
    those of `image`; linear between pixels, 0 outside.

    ramp (R * C,): 0 to R - 1, each C times. In pieces of at most R pixels, over which places are linear in the column; a piece is parted
    where the neighbouring pixels change, so that the inner loop reads rows on end.
    """
    height, width = image.shape[0], image.shape[1] // channels
    longest = len(ramp) // channels
    for y in range(height):
        x = 0
        while x < width:
            count = min(longest, width - x)
            w = matrix[2, 0] * x + matrix[2, 1] * y + matrix[2, 2]
            u = (matrix[0, 0] * x + matrix[0, 1] * y + matrix[0, 2]) / w
            v = (matrix[1, 0] * x + matrix[1, 1] * y + matrix[1, 2]) / w
            w += matrix[2, 0] * count
            du = ((matrix[0, 0] * (x + count) + matrix[0, 1] * y + matrix[0, 2]) / w - u) / count
            dv = ((matrix[1, 0] * (x + count) + matrix[1, 1] * y + matrix[1, 2]) / w - v) / count
            i, j = int(np.floor(v)), int(np.floor(u))
            p, q = u - j, v - i
            # at most `longest`: where a place hardly moves the quotient is more than an integer holds
            if du > 1:
                count = min(count, 1 + int(min((1 - p) / (du - 1), longest)))
            elif du < 1:
                count = min(count, 1 + int(min(p / (1 - du), longest)))
            if dv > 0:
                count = min(count, 1 + int(min((1 - q) / dv, longest)))
            elif dv < 0:
                count = min(count, 1 + int(min(q / -dv, longest)))
            if not (0 <= i < height - 1):
                out[y, x * channels : (x + count) * channels] = 0
                x += count
                continue
            first = min(max(-j, 0), count)
            last = max(min(width - 1 - j, count), first)
            out[y, x * channels : (x + first) * channels] = 0
            out[y, (x + last) * channels : (x + count) * channels] = 0
            begin, end, right = (j + first) * channels, (j + last) * channels, (j + first + 1) * channels
            above, above_right = image[i, begin:end], image[i, right : end + channels]
            below, below_right = image[i + 1, begin:end], image[i + 1, right : end + channels]
            target, steps = out[y, (x + first) * channels : (x + last) * channels], ramp[first * channels : last * channels]
            p0, dp, q0, dq = np.float32(p), np.float32(du - 1), np.float32(q), np.float32(dv)
            for k in range(len(target)):
                across, down = p0 + steps[k] * dp, q0 + steps[k] * dq
                a, c = np.float32(above[k]), np.float32(below[k])
                top, bottom = a + across * (np.float32(above_right[k]) - a), c + across * (np.float32(below_right[k]) - c)
                target[k] = np.uint8(np.int32(top + down * (bottom - top) + np.float32(0.5)))
            x += count


@reduction_kernel
def divided(image, scene, factors, clips, out):
    """Fill `out` with an image times `factors`, rounded; both of uint8, (H, W * C). If `clips`, what a clipped pixel of the scene
    (H, W * C) would lack of its level is added.

    factors (R, W * C), float32, are of R bands of equal height, and interpolated between their middles.
    """
    height, last = len(image), len(factors) - 1
    most = np.float32(255)
    for y in range(height):
        place = min(max((y + 0.5) / height * (last + 1) - 0.5, 0.0), float(last))
        band = min(int(place), max(last - 1, 0))
        above, below = factors[band], factors[min(band + 1, last)]
        q = np.float32(place - band)
        if clips:
            for k in range(image.shape[1]):
                factor = above[k] + q * (below[k] - above[k])
                lacking = max(np.float32(scene[y, k]) - most * factor, np.float32(0))
                out[y, k] = np.uint8(np.int32(min(np.float32(image[y, k]) * factor + lacking + np.float32(0.5), most)))
        else:
            for k in range(image.shape[1]):
                factor = above[k] + q * (below[k] - above[k])
                out[y, k] = np.uint8(np.int32(min(np.float32(image[y, k]) * factor + np.float32(0.5), most)))


@kernel
def log_ratios(view, rows, columns, levels, informative, log, bounds, beyond, use):
    """Fill `beyond` (C, n) with the log ratios of a picture (H, W, C), uint8, at places (n,) and of the scene's log `levels` (C, n); `use`
    (C, n) with 1 where both show a gain: `informative` (C, n) of the scene, and the picture between the two `bounds`; else both with 0."""
    for n in range(len(rows)):
        for c in range(view.shape[2]):
            level = view[rows[n], columns[n], c]
            shown = informative[c, n] and bounds[0] < level < bounds[1]
            use[c, n] = np.float32(shown)
            beyond[c, n] = log[level] - levels[c, n] if shown else np.float32(0)


@reduction_kernel
def surface_weights(beyond, use, fit, spreads, histogram, weights, total, moment):
    """Fill `weights` (C, n) with those of log gains `beyond` (C, n) about a surface's, `fit` (n,), by Geman and McClure; `total` (n,) with
    their sums over the channels, `moment` (n,) with those of weights times log gains.

    use (C, n): 1 for values that count, else 0; spreads: least and greatest standard deviation of such a value about the surface, which is
    estimated from the median distance, by a histogram (B,), work space.
    """
    width, number = np.float32(spreads[1] / 1.4826 / len(histogram)), np.float32(0)
    scale, last = 1 / width, len(histogram) - 1
    histogram[:] = 0
    for c in range(len(beyond)):
        for n in range(len(fit)):
            histogram[min(int(abs(beyond[c, n] - fit[n]) * scale), last)] += use[c, n]
    for place in range(last + 1):
        number += histogram[place]
    place, below = 0, np.float32(0)
    while place < last and 2 * (below + histogram[place]) < number:
        below += histogram[place]
        place += 1
    median = width * (place + (number / 2 - below) / max(histogram[place], np.float32(1)))
    scale = np.float32(0.5 / min(max(1.4826 * median, spreads[0]), spreads[1]))
    total[:], moment[:] = 0, 0
    for c in range(len(beyond)):
        values, counted, weight = beyond[c], use[c], weights[c]
        for n in range(len(fit)):
            far = (values[n] - fit[n]) * scale
            root = 1 / (1 + far * far)
            weight[n] = counted[n] * root * root
            total[n] += weight[n]
            moment[n] += weight[n] * values[n]


@compiled(nogil=True)
def modes(pixels, levels, informative, log, bounds, width, least, window, shifts, sums, out):
    """Fill `out` (C,) with the mode of each channel's log gain, in bins of a histogram, by mean shift from its fullest part; not a number
    where less than a share `least` of the pixels show a gain.

    pixels (n, C), uint8: of the frame; levels (n, C): log levels of the scene; informative (n, C): whether the scene's pixel may show a
    gain, which the frame's does if it lies between the two `bounds`; log (256,): logarithms of grey levels; width: of a bin; window: half
    width, in bins, of the mean shift, and its number of steps, `shifts`; sums (2, bins + 1): work space.
    """
    total, moment, bins = sums[0], sums[1], sums.shape[1] - 1
    for c in range(pixels.shape[1]):
        sums[:] = 0
        used = 0
        for n in range(pixels.shape[0]):
            level = pixels[n, c]
            if informative[n, c] and bounds[0] < level < bounds[1]:
                used += 1
                place = int(np.rint((log[level] - levels[n, c]) / width)) + bins // 2
                total[min(max(place, 0), bins - 1) + 1] += 1
        if used < least * pixels.shape[0]:
            out[c] = np.nan
            continue
        for k in range(bins):
            moment[k + 1] = moment[k] + k * total[k + 1]
            total[k + 1] += total[k]
        narrow = window // 3
        middle = float(np.argmax(total[2 * narrow + 1 :] - total[: -2 * narrow - 1]) + narrow)
        for _ in range(shifts):
            first, last = max(0, round(middle) - window), min(bins, round(middle) + window + 1)
            middle = (moment[last] - moment[first]) / (total[last] - total[first])
        out[c] = middle - bins // 2


@kernel
def restore_detail(image, smooth, scene, detail, inverse, quiet, near, out):
    """Move pixels (H, W, C) of a picture, uint8, back by the share of `detail` that they have lost: from 0 to 1, that by which the smoothed
    picture lies from the `scene` toward scene + detail; inverse: of the squared length of `detail`, (H, W), or 0. Pixels nearer than
    `quiet` to the scene, or farther than `near` from that line, root mean square of the channels, stay as they are."""
    height, width, channels = image.shape
    quiet, near = channels * quiet * quiet, channels * near * near
    for y in range(height):
        for x in range(width):
            if channels == 3:
                _restore_three(image[y, x], smooth[y, x], scene[y, x], detail[y, x], inverse[y, x], quiet, near, out[y, x])
            else:
                far, less = np.float32(smooth[y, x, 0]) - scene[y, x, 0], detail[y, x, 0]
                lost = min(max(far * less * inverse[y, x], np.float32(0)), np.float32(1))
                rest = far - lost * less
                lost = lost if far * far > quiet and rest * rest <= near else np.float32(0)
                out[y, x, 0] = _rounded(np.float32(image[y, x, 0]) - lost * less)


@device
def _restore_three(image, smooth, scene, detail, inverse, quiet, near, out):
    """`restore_detail` for a pixel of three channels; quiet, near: three times their squares."""
    f0, f1, f2 = np.float32(smooth[0]) - scene[0], np.float32(smooth[1]) - scene[1], np.float32(smooth[2]) - scene[2]
    out[0], out[1], out[2] = image[0], image[1], image[2]
    if f0 * f0 + f1 * f1 + f2 * f2 <= quiet:
        return
    d0, d1, d2 = detail[0], detail[1], detail[2]
    lost = min(max((f0 * d0 + f1 * d1 + f2 * d2) * inverse, np.float32(0)), np.float32(1))
    r0, r1, r2 = f0 - lost * d0, f1 - lost * d1, f2 - lost * d2
    if r0 * r0 + r1 * r1 + r2 * r2 <= near:
        out[0], out[1], out[2] = (_rounded(np.float32(image[0]) - lost * d0), _rounded(np.float32(image[1]) - lost * d1),
                                  _rounded(np.float32(image[2]) - lost * d2))


@device
def _rounded(value):
    """A grey level as uint8."""
    return np.uint8(min(max(value + np.float32(0.5), np.float32(0)), np.float32(255)))
