"""The text of docs/detectability.md, with the figures of the study."""

from __future__ import annotations

from collections.abc import Sequence

from lab.detectability_fit import auc, brier
from lab.detectability_report import (
    ENOUGH,
    WHOLE,
    Sample,
    bin_rows,
    both_bins,
    detector_rows,
    false_certainty,
    group_rows,
    score_rows,
    worst_error,
    worst_groups,
)
from pytest_garl.verdicts.detectability import READABLE

HEAD = "| frames | predicted | read | error |\n| ---: | ---: | ---: | ---: |\n"


def page(held_out: Sample, others: Sequence[Sample]) -> str:
    """Return the page about held-out frames: the usual ones, and those of the other kinds."""
    whole = held_out.where(held_out.share_in_frame >= WHOLE)
    cut = held_out.where(held_out.share_in_frame < WHOLE)
    tenth, decile = both_bins(whole)
    sure, certain, hopeless, without_hope = false_certainty(whole)
    worst = ";\n".join(
        f"{name} ({count} frames, {error:+.3f})" for name, count, error in worst_groups(whole)
    )
    by_map = "; ".join(
        f"{name} {worst_error(both_bins(whole.where(whole.map == index))[1]):.3f}"
        for index, name in enumerate(("court", "lawn"))
    )
    return _PAGE.format(
        frames=len(held_out.read),
        held_out=len(whole.read),
        cut=len(cut.read),
        cut_predicted=f"{cut.predicted.mean():.3f}",
        cut_read=f"{cut.read.mean():.3f}",
        detectors="\n".join(detector_rows(whole)),
        scores="\n".join(score_rows(whole)),
        tenths=HEAD + "\n".join(bin_rows(tenth)),
        deciles=HEAD + "\n".join(bin_rows(decile)),
        worst_tenth=f"{worst_error(tenth):.3f}",
        worst_decile=f"{worst_error(decile):.3f}",
        enough=ENOUGH,
        sure=f"{100 * sure:.1f}",
        certain=certain,
        hopeless=f"{100 * hopeless:.1f}",
        without_hope=without_hope,
        groups="\n".join(group_rows(whole)),
        worst=worst,
        by_map=by_map,
        others="\n".join(_row(name, each) for name, each in zip(_OTHERS, others, strict=True)),
        readable=READABLE,
        remains=_REMAINS,
    )


_OTHERS = ("blurred", "from 12 to 45 m", "cut by the frame's edge", "with more in the air")


def _row(name: str, sample: Sample) -> str:
    """Return the number of frames, the means and the scores, as a row of a table."""
    predicted, read = sample.predicted, sample.read
    means = f"{len(read)} | {predicted.mean():.3f} | {read.mean():.3f}"
    return f"| {name} | {means} | {auc(predicted, read):.3f} | {brier(predicted, read):.3f} |"


_REMAINS = """The sixteen scenarios on either side in which the oracle is most wrong were looked at.

Predicted to be read, and not read:

- A dark person or dog covers part of the black border and crosses its outline. Black under
  something dark counts as not hidden, but ArUco no longer finds four straight sides.
- The edge of a dirt patch on the lens crosses the marker. The oracle knows the light that is lost
  and how uneven it is, and not where.
- Leaves, wear or snow lie on a corner or across the outline of a marker that fills the frame, above
  20 pixels per module. ArUco needs the outline, and the learned detector looks at such a marker
  shrunk. The oracle knows the shares, not the places.
- A single falling leaf hangs in front of the marker's bits. The oracle knows only how many are
  expected.

Predicted not to be read, and read:

- A movement blurs the marker over three modules, a tarpaulin lies over a third of it, or most of
  the bits are under leaves, and the learned detector still finds the marker. It knows only four
  ids, so that some of its answers are guesses that are right.
- The marker shows a few grey levels of contrast in fog or at night, and one of the detectors still
  finds it."""

_PAGE = """# Could the marker be read?

Written by `python -m lab.detectability`.

A landing system that does not find a marker may be bad, or nobody could have found it. The
detectability oracle tells the two apart from the scene itself, whatever the system says: for each
frame it gives the probability that a good detector reads the marker. From {readable:g} on a
marker counts as readable in a frame. Verdicts use it to say whether a marker was "seen", and to
excuse a landing that was given up: only if, where a nominal landing looks for the marker, it
could be read for less than 2 s in all. Nominal views are those of a level camera above the told
coordinate, from eight places 5 m about it, and above the marker at 10, 6 and 3 m. They never
depend on the path that a system flew.

## What it looks at

The camera computes a `MarkerView` for each frame from the geometry and the conditions, without
painting a picture (0.1 to 0.25 ms). A marker of 7 by 7 modules lies on a white board with a margin
of one module; nine places of each module are looked at.

| fact | meaning |
| --- | --- |
| `px_per_module` | side of a module in pixels, along the shorter axis |
| `share_in_frame`, `edge_modules` | share in the frame; modules from the marker to the edge |
| `border_hidden`, `bits_hidden`, `margin_hidden` | shares that things turn into the other colour |
| `contrast`, `noise` | grey levels between white and black in the picture; the sensor's noise |
| `uneven_light` | standard deviation of the light on the marker, as in a shadow or behind dirt |
| `clutter` | share of the picture that falling things are expected to cover |
| `blur_px` | how far the marker moves over the picture while it is exposed |

Black that snow turns white counts in full and white under snow does not count. A leaf, and ground
where the paint is worn off, count in part on either.

## How it was calibrated

{frames} frames were drawn from random scenarios of both maps: weather and light over their full
range, any place and turn of the marker and of the sun, people, dogs and birds on and beside the
marker, heights from 0.5 to 12 m, tilts up to 20°, all headings; in a quarter of the scenarios each,
over all that a file may name: a worn marker, a tarpaulin over it, an exposure time while the UAV
moves and turns, dirt on the lens, a decoy. An error of the camera's mounting is a tilt like others,
and one of its focal length another height. Places and values were drawn so that many frames are
neither easy nor hopeless, so the shares below are not those of flights. A frame is read if one of
three detectors finds id 0 within 0.75 m of the marker's middle: OpenCV's ArUco with its stock
parameters; ArUco with the parameters of OpenCV-MLS and all four of its ways to look at a frame; the
[learned detector](detection.md) with a confidence of at least 0.8. The learned detector ignores
markers that the frame cuts below 2 m. This is a decision about landing and not about sight, so it
was switched off.

The oracle is one layer of eight logistic units with weights that are not negative and a logistic
unit over them, so that more pixels and more contrast never lower the probability, and more that
is hidden, noise, blur, clutter or uneven light never raises it. The shipped coefficients are
fitted to all frames. For the figures below the scenarios were halved, and the frames of either
half are predicted by an oracle that was fitted to the other half, so that no frame and no
scenario is predicted by what was fitted to it. They are of the {held_out} frames with at least 90
% of the marker in them.

| detector | share of frames read |
| --- | ---: |
{detectors}

## How good it is

| prediction by | AUC | Brier score |
| --- | ---: | ---: |
{scores}

Tenths of the range of probabilities; the largest error of one with at least {enough} frames is
{worst_tenth}:

{tenths}

Ten groups of equal size in the order of their predictions; the largest error is {worst_decile}:

{deciles}

![Reliability](pictures/detectability.png)

False certainty: {sure} % of the {certain} frames with a probability of at least 0.9 are not read,
and {hopeless} % of the {without_hope} frames with at most 0.1 are read. Of {cut} frames with less
than 90 % of the marker in them, {cut_predicted} are predicted to be read and {cut_read} are.

Further frames are part of the fit and not of the tables: frames that were blurred after they were
painted, farther than an exposure between two frames blurs; frames from 12 to 45 m, where modules
are smaller than a flight with the default camera shows them; frames from 0.25 to 10 m whose edge
cuts most markers; frames with flakes, drops or leaves over any share of the picture, more than ever
fall.

| further frames | number | predicted | read | AUC | Brier score |
| --- | ---: | ---: | ---: | ---: | ---: |
{others}

## By map, height, size and condition

The largest error of a group of equal size is, per map: {by_map}. The groups of at least
{enough} frames whose mean prediction errs most:
{worst}.

| frames | number | predicted | read | error | AUC |
| --- | ---: | ---: | ---: | ---: | ---: |
{groups}

## What remains

{remains}

## Limits

- It is about this camera model and this marker: a pinhole, no rolling shutter, one dictionary.
  Sizes are in pixels per module, so that other cameras and heights are covered within the range
  above.
- It tells whether a frame can be read by one of these three detectors. The learned one reads
  nearly all of what any reads, and far more than ArUco does: a lump of snow across the border
  stops ArUco, so that a system with ArUco alone can give up in sight of a readable marker. A
  better detector may read more. A system that needs several frames in a row reads less.
- Falling leaves and flakes count by their expected share of the picture, and not by where they
  are in this frame.
- Decoys beside the marker play no part: a marker can be read whatever else can be.
"""
