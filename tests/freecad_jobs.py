"""Run by FreeCAD, not by pytest: a block with a pocket, posted once for each case that the environment states.

``CASES``: a JSON list of {file, arguments, pattern, ...}; ``RESULT``: the file of what came of them.
"""

import json
import os
import traceback

import FreeCAD
import Part
import PathScripts.PathJob as PathJob
import PathScripts.PathPocketShape as PathPocketShape
import PathScripts.PathPost as PathPost


def pocket_job():
    """A block of 120 x 80 x 20 mm whose pocket of 60 x 40 x 8 mm is cut in levels of 2.5 mm by a cutter of 5 mm."""
    document = FreeCAD.newDocument("part")
    block = document.addObject("Part::Feature", "Block")
    hole = Part.makeBox(60, 40, 8, FreeCAD.Vector(30, 20, 12))
    block.Shape = Part.makeBox(120, 80, 20).cut(hole)
    document.recompute()
    job = PathJob.Create("Job", [block], None)
    control = job.Tools.Group[0]
    control.SpindleSpeed, control.HorizFeed, control.VertFeed = 12000.0, "1800 mm/min", "400 mm/min"
    control.Tool.Flutes = 3
    pocket = PathPocketShape.Create("Pocket")
    model = job.Model.Group[0]
    heights = [(face.BoundBox.ZMin, face.BoundBox.ZMax) for face in model.Shape.Faces]
    floor = next(k for k, ends in enumerate(heights) if max(abs(end - 12) for end in ends) < 1e-6)
    pocket.Base = [(model, [f"Face{floor + 1}"])]
    pocket.ToolController = control
    pocket.setExpression("StepDown", None)  # it is bound to the tool's diameter
    pocket.StepDown, pocket.StepOver = 2.5, 40
    return document, job, pocket


def main():
    document, job, pocket = pocket_job()
    came = []
    for case in json.loads(os.environ["CASES"]):
        pocket.OffsetPattern = case.get("pattern", "Offset")
        job.Tools.Group[0].SpindleSpeed = case.get("speed", 12000.0)
        document.recompute()
        job.PostProcessor, job.PostProcessorArgs = "compensate", case["arguments"]
        job.PostProcessorOutputFile = case["file"]
        command = PathPost.CommandPathPost()
        try:
            (objects,) = command.buildPostList(job)
            failed, text, file = command.exportObjectsWith(objects, job)
            came.append({"failed": failed, "text": text, "file": file})
        except Exception as error:
            came.append({"error": str(error), "traceback": traceback.format_exc()})
    with open(os.environ["RESULT"], "w", encoding="utf-8") as stream:
        json.dump(came, stream)


main()
