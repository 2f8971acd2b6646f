"""After Effects: a script that builds the performance as shape layers (File > Scripts > Run Script File...).

Each part becomes a shape layer, each painted element a group in it with its outlines keyed for every new drawing.  The
keys are holds where drawings are held, straight ways otherwise.  A gradient's colours cannot be set by a script, so the
middle of them is painted; Lottie, by the Bodymovin importer, brings the gradients too.
"""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from capture.files import written_beside
from retarget.characters.drawings.paths import DrawnPath, Gradient, Paint
from retarget.export import lottie
from retarget.export.elements import Element, Layer, Page, kept, page_of, refused
from retarget.stage.perform import Performance

Curve = dict[str, list[Any]]  # "t" seconds and "v" values

SCRIPT = """\
(function () {
  var comp, layers = LAYERS;
  function follow(property, curve, stepped) {
    if (curve.v.length === 1) { property.setValue(curve.v[0]); return; }
    property.setValuesAtTimes(curve.t, curve.v);
    for (var k = 1; k <= property.numKeys; k++) {
      var way = stepped ? KeyframeInterpolationType.HOLD : KeyframeInterpolationType.LINEAR;
      property.setInterpolationTypeAtKey(k, way, way);
    }
  }
  function shapes(curve) {
    var made = [];
    for (var n = 0; n < curve.v.length; n++) {
      var shape = new Shape();
      shape.vertices = curve.v[n].v;
      shape.inTangents = curve.v[n].i;
      shape.outTangents = curve.v[n].o;
      shape.closed = curve.v[n].c;
      made.push(shape);
    }
    return { t: curve.t, v: made };
  }
  function paint(inside, kind, told, stepped) {
    var graphic = inside.addProperty("ADBE Vector Graphic - " + kind);
    follow(graphic.property("ADBE Vector " + kind + " Color"), told.color, stepped);
    follow(graphic.property("ADBE Vector " + kind + " Opacity"), told.opacity, stepped);
    return graphic;
  }
  app.beginUndoGroup("tooncap");
  comp = app.project.items.addComp(NAME, WIDTH, HEIGHT, 1, DURATION, FPS);
  for (var l = 0; l < layers.length; l++) {
    var layer = comp.layers.addShape();
    layer.name = layers[l].name;
    layer.property("ADBE Transform Group").property("ADBE Position").setValue([0, 0]);
    follow(layer.property("ADBE Transform Group").property("ADBE Opacity"), layers[l].seen, true);
    var contents = layer.property("ADBE Root Vectors Group");
    for (var e = 0; e < layers[l].elements.length; e++) {
      var told = layers[l].elements[e], stepped = layers[l].stepped;
      contents.addProperty("ADBE Vector Group").name = told.name;
      var number = contents.numProperties;
      var inside = contents.property(number).property("ADBE Vectors Group");
      for (var p = 0; p < told.paths.length; p++) {
        var path = inside.addProperty("ADBE Vector Shape - Group");
        follow(path.property("ADBE Vector Shape"), shapes(told.paths[p]), stepped);
      }
      if (told.stroke) {
        var stroke = paint(inside, "Stroke", told.stroke, stepped);
        follow(stroke.property("ADBE Vector Stroke Width"), told.stroke.width, stepped);
        stroke.property("ADBE Vector Stroke Line Cap").setValue(told.stroke.cap);
        stroke.property("ADBE Vector Stroke Line Join").setValue(told.stroke.join);
      }
      if (told.fill) {
        paint(inside, "Fill", told.fill, stepped).property("ADBE Vector Fill Rule").setValue(told.fill.rule);
      }
      var group = contents.property(number).property("ADBE Vector Transform Group");
      follow(group.property("ADBE Vector Group Opacity"), told.opacity, stepped);
    }
  }
  comp.openInViewer();
  app.endUndoGroup();
})();
"""


def write_jsx(performance: Performance, path: str | Path, width: int | None = None, background: Any = None) -> None:
    """A performance as a *.jsx script for After Effects; a background is the user's own layer there."""
    page = page_of(performance, width, background)
    for layer in page.layers:
        if not all(isinstance(element.drawn[0], DrawnPath) for element in layer.elements):
            raise refused(layer, "a script for After Effects", "vector drawings")
    told = {
        "LAYERS": [_layer(layer, page) for layer in page.layers],  # the last one made lies in front
        "NAME": Path(path).stem,
        "WIDTH": page.size[0],
        "HEIGHT": page.size[1],
        "DURATION": page.duration,
        "FPS": page.fps,
    }
    text = SCRIPT
    for name, value in reversed(told.items()):  # the layers last: a part may be called WIDTH
        text = text.replace(name, json.dumps(value, separators=(",", ":"), allow_nan=False), 1)
    with written_beside(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def _layer(layer: Layer, page: Page) -> dict[str, Any]:
    def curve(values: Sequence[Any], stepped: bool = layer.stepped) -> Curve:
        keys = kept(values, stepped)
        return {"t": np.round(page.starts[keys], 6).tolist(), "v": [values[t] for t in keys]}

    return {
        "name": layer.name,
        "stepped": layer.stepped,
        "seen": curve([100 if seen else 0 for seen in layer.visible], True),
        "elements": [_element(element, curve) for element in reversed(layer.elements)],
    }


def _element(element: Element, curve: Any) -> dict[str, Any]:
    first = element.drawn[0]
    points = np.stack([path.points for path in element.drawn])
    told = {
        "name": element.name,
        "paths": [curve([value[0] for value in values]) for values in lottie.outline_values(first, points)],
        "opacity": curve([round(100 * opacity, 2) for opacity in element.curve("opacity")]),
    }
    if first.fill is not None:
        told["fill"] = {**_color(element.curve("fill"), curve), "rule": 2 if first.evenodd else 1}
    if first.stroke is not None:
        pen = {"cap": lottie.CAPS[first.cap], "join": lottie.JOINS[first.join]}
        width = curve(np.round(element.curve("width"), 3).tolist())
        told["stroke"] = {**_color(element.curve("stroke"), curve), "width": width, **pen}
    return told


def _color(paints: Sequence[Paint], curve: Any) -> dict[str, Curve]:
    colors = [paint.colors.mean(axis=0) if isinstance(paint, Gradient) else paint for paint in paints]
    told = np.round(np.clip(np.stack(colors), 0, 1), 4)
    return {"color": curve([[*rgb, 1] for rgb in told[:, :3].tolist()]), "opacity": curve((100 * told[:, 3]).tolist())}
