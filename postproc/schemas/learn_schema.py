"""The schema of the result of ``learn``."""

from __future__ import annotations

from postproc.report.learned import GROUPS, VERDICTS
from postproc.schemas.parts import Schema
from postproc.schemas.result_parts import DATA, ENDING, array, integer, quantity, record, result, word


def learn_schema() -> Schema:
    cause = {
        "cause": word("name"),
        "group": word("what it belongs to", GROUPS),
        "value": quantity("unit of the cause", "the most probable value; of a share, the factor"),
        "lower": quantity("unit of the cause", "lower end of its 95 % interval"),
        "upper": quantity("unit of the cause", "upper end of its 95 % interval"),
        "unit": word("unit of the cause; 1: a factor"),
        "before_ci95": quantity(
            "unit of the cause", "half width of its 95 % interval before the measurement"
        ),
    }
    likelier = {
        "effect": word("name of the effect"),
        "likelihood_gain": quantity("1", "natural logarithm of how much likelier the deviations are with it"),
    }
    product = {
        "causes": array(word("name of the cause"), "two causes"),
        "ci95": quantity("1", "half width of the 95 % interval of the logarithm of their product"),
    }
    promise = {
        "before_rms_mm": quantity("mm", "error of the measured part, without the scatter of the probe"),
        "after_rms_mm": quantity("mm", "error that the next part is expected to have"),
        "lower_rms_mm": quantity("mm", "lower end of its 95 % interval"),
        "upper_rms_mm": quantity("mm", "upper end of its 95 % interval"),
    }
    part = {
        "file": word("file of the measured part"),
        "program_sha256": word("SHA-256 of the program that cut it"),
        "rms_mm": quantity("mm", "its error, without the scatter of the probe, root mean square"),
        "promised_lower_rms_mm": quantity("mm", "lower end of what was promised of it", nullable=True),
        "promised_upper_rms_mm": quantity("mm", "upper end of what was promised of it", nullable=True),
    }
    following = {
        "file": word("file of the next program", nullable=True),
        "corrected": integer("motions that are corrected"),
        "error_after_max_mm": quantity("mm", "largest predicted error of the next program", nullable=True),
        "exit": integer("exit code of the compensation"),
    }
    return result(
        "learn",
        "the causes of the deviations of a measured part",
        {
            "program": word("file of the original program"),
            "robot": word("name of the robot"),
            "data": DATA,
            "points": record(
                {
                    "measured": integer("points with a deviation"),
                    "used": integer("points that the attribution uses"),
                    "outliers": integer("points that are excluded as outliers"),
                },
                "measured points",
            ),
            "verdict": word("whether the known causes explain the part", VERDICTS),
            "named": array(record(likelier, "one effect"), "effects that are named"),
            "alternatives": array(
                record(likelier, "one effect"), "effects that are not named, the likeliest first"
            ),
            "ambiguous": array(word("name of the effect"), "effects that the points can not distinguish"),
            "causes": array(record(cause, "one cause"), "causes with what the part says of them"),
            "unobserved": array(word("name of the cause"), "causes that keep what was known before"),
            "products": array(record(product, "one pair"), "pairs of which only the product is known"),
            "smooth": record(
                {
                    "rms_mm": quantity("mm", "root mean square of the smooth error without a name"),
                    "length_mm": quantity("mm", "length over which it changes"),
                    "unshared_mm": quantity("mm", "error that no two points share, beside the probe's"),
                },
                "what no cause explains",
            ),
            "residual_rms_mm": quantity("mm", "root mean square of what nothing explains"),
            "promise": record(
                promise, "errors of the next part at places like the measured ones, root mean square"
            ),
            "history": array(record(part, "one part"), "the parts in their order"),
            "gain": quantity("1", "share of what was learnt that the next program applies"),
            "next_program": record(following, "the next program; null where none is written", nullable=True),
            **ENDING,
        },
    )
