"""The codes of the findings of learning from a measured part."""

from __future__ import annotations

from postproc.base.findings import Code, define

CODES = define(
    {
        "LRN001": Code(
            "error",
            "measured part is wrong",
            meaning="A comment, the header or a row of the CSV of the measured part cannot be used.",
            consequence="A deviation that is misread would make the next part worse.",
            action="Correct the row, column or comment that the message names.",
            example="A file without `# positive: material_left`.",
        ),
        "LRN002": Code(
            "error",
            "another program cut this part",
            meaning="The program that the file names is not the one that is there, or does not come from PROGRAM.",
            consequence="The corrections of the program that cut are a part of every deviation.",
            action="Name the program that cut the part, and state its SHA-256.",
            example="`# sha256:` of a program that was compensated again after the cut.",
        ),
        "LRN003": Code(
            "error",
            "points do not lie on the surface of this part",
            meaning="No tool of the program touches most of the points.",
            consequence="The deviations belong to another part, base or unit.",
            action="State nominal points (mm) and outward normals in the axes of the program's $BASE.",
            example="Points in metres, or of the next part on the fixture.",
        ),
        "LRN004": Code(
            "error",
            "deviations contradict everything that could cause them",
            meaning="No cause explains these deviations as the file states them.",
            consequence="A mistake in the file would be copied into the next part.",
            action="Check the sign, the order of the rows, the probe radius and the unit of DEV.",
            example="A file with `material_left` whose values count material that is missing.",
        ),
        "LRN005": Code(
            "info",
            "points are not used",
            meaning="No motion, or more than one, may have cut these points.",
            consequence="They are excluded; fewer points lead to wider intervals.",
            action="Measure places that one motion leaves; LINE or OPERATION names the motion.",
            example="A point that the program leaves as it was on the blank.",
        ),
        "LRN006": Code(
            "warning",
            "outliers are excluded",
            meaning="These deviations are far from what all others and the causes predict.",
            consequence="They have no influence on the result.",
            action="Measure these points again: dirt, a burr, or a wrong row.",
            example="A deviation of 0.3 mm between neighbours of 0.05 mm.",
        ),
        "LRN007": Code(
            "info",
            "shape of a tool is assumed",
            meaning="The process states no shape of the tool; a flat end with the diameter of the cell is taken.",
            consequence="Points that another shape touches are matched to other motions.",
            action="State the tool in the process file: tools: {1: {shape: ball, diameter: 16}}.",
            example="A cell with `diameter: 16` and no process file.",
        ),
        "LRN008": Code(
            "info",
            "what this part does not show",
            meaning="Only the product of some causes is visible, or a cause keeps what was known of it before.",
            consequence="Its value is that of before, and its interval shows it.",
            action="Use a push test, a known force, a spring pass or a tool setter: they separate them.",
            example="The force times the compliance of all joints.",
        ),
        "LRN009": Code(
            "warning",
            "no better program is known",
            meaning="What was learnt does not promise a smaller error than that of the measured part.",
            consequence="The next program is not written.",
            action="Measure more points, or with less scatter; look at the causes.",
            example="A part whose errors are within the noise of the probe.",
        ),
        "LRN010": Code(
            "warning",
            "smooth error without a name",
            meaning="A part of the error is the same between neighbours, and no known effect explains it.",
            consequence="It is corrected at this place in this program only, and never carried elsewhere.",
            action="Nothing needs to be done for the same part at the same place.",
            example="A fixture that is compliant under the plate.",
        ),
        "LRN011": Code(
            "error",
            "this program cannot be learnt from",
            meaning="The program or the cell has something that the attribution does not know.",
            consequence="Causes would be mistaken for each other.",
            action="Change what the message names.",
            example="External axes that move while the tool cuts.",
        ),
        "LRN012": Code(
            "info",
            "an effect is named",
            meaning="The deviations are far likelier with this effect than without, and than with any other.",
            consequence="It is in the new robot file, or in the next program.",
            action="Compare it with what is known of the machine.",
            example="Hysteresis of A1.",
        ),
        "LRN013": Code(
            "warning",
            "several effects explain the rest",
            meaning="Effects are about as likely as each other.",
            consequence="None of them is named or carried to another place.",
            action="Measure more points, or the same feature cut first and last.",
            example="Drift, and the order of the operations.",
        ),
        "LRN014": Code(
            "info",
            "points were cut by the uncompensated program",
            meaning="The engagement of the tool changes with a large error, and the force follows it.",
            consequence="Forces learnt from it are those of the error that the tool had.",
            action="Measure the next part too, and learn from it.",
            example="`# cut_with: original`.",
        ),
    }
)
