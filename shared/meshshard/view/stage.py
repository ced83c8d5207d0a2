"""The scene: a mesh once or twice, its wireframe, and the vertex that was clicked."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import viser
from jaxtyping import Float

from meshshard.render import AMBIENT, LIGHT, View
from meshshard.sample import Sample
from meshshard.view.colouring import Coloured
from meshshard.view.geometry import clicked_corner, glb_bytes

DISTANCE, FIELD = 12.5, 12.0
"""Of the camera at first, in radii of a mesh; its vertical field of view in degrees, narrow: two meshes side by side
are seen from nearly the same direction."""

HALF, APART = 0.5, 0.54
"""Two meshes are drawn at half the size, this far from the middle, in radii."""

INK = (0, 0, 0)

MARK, MAGENTA = 0.02, (255, 0, 255)
"""Radius and colour of the mark: a colour that neither classes nor numbers have."""

Clicked = Callable[[Sample, int, int], None]
"""Takes a mesh, a face of it and the vertex of that that is nearest."""


@dataclass(eq=False)
class _Pane:
    """One drawing of the mesh, with its wireframe and mark as children."""

    solid: viser.GlbHandle
    wires: viser.MeshHandle
    mark: viser.IcosphereHandle


class Stage:
    """Draws on a server's scene; `clicked` is called, from another thread, with what somebody clicks."""

    def __init__(self, server: viser.ViserServer, clicked: Clicked) -> None:
        self._scene, self._clicked = server.scene, clicked
        self._panes: list[_Pane] = []
        self._sample: Sample | None = None
        self._axes = View().axes
        server.scene.set_up_direction("+y")
        server.scene.configure_default_lights(enabled=False)
        server.scene.configure_environment_map(None)
        server.scene.add_light_ambient("/everywhere", intensity=np.pi * AMBIENT)
        self._lamp = server.scene.add_light_directional("/lamp", intensity=np.pi * (1 - AMBIENT))
        camera = server.initial_camera
        camera.position = tuple(DISTANCE * View().axes[2])
        camera.look_at, camera.fov = (0.0, 0.0, 0.0), np.deg2rad(FIELD)
        server.on_client_connect(self._joined)
        # not of the meshes: those that may be clicked get a broad outline, over their colours, under the mouse
        server.scene.on_click()(lambda event: self._click(np.array(event.ray_origin), np.array(event.ray_direction)))

    def show(self, sample: Sample, drawings: list[Coloured], wireframe: bool) -> bool:
        """Draw a mesh once for each of its one or two colourings. False: it was there in other colours, and keeps its
        mark; True: it has none."""
        again = sample is self._sample and len(drawings) == len(self._panes)
        if not again:
            # those that stay are replaced: a browser puts a node that is removed and added again where it was
            for pane in self._panes[len(drawings) :]:
                pane.solid.remove()
            self._sample, self._panes = sample, []
        for number, drawing in enumerate(drawings):
            glb = glb_bytes(sample.vertices, sample.faces, drawing.colours, drawing.of_faces)
            if again:
                self._panes[number].solid.glb_data = glb
            else:
                self._panes.append(self._pane(number, sample, glb, HALF if len(drawings) > 1 else 1.0))
            self._panes[number].wires.visible = wireframe
        self._place()
        return not again

    def mark(self, vertex: int) -> None:
        """Put a small ball on a vertex of the mesh."""
        assert self._sample is not None
        for pane in self._panes:
            pane.mark.position = self._sample.vertices[vertex] * pane.solid.scale
            pane.mark.visible = True

    def _pane(self, number: int, sample: Sample, glb: bytes, scale: float) -> _Pane:
        scene, name = self._scene, f"/mesh{number}"
        solid = scene.add_glb(name, glb, scale=scale)
        vertices, faces = sample.vertices, sample.faces
        wires = scene.add_mesh_simple(
            f"{name}/wires", vertices, faces, color=INK, wireframe=True, scale=scale, visible=False
        )
        mark = scene.add_icosphere(f"{name}/mark", radius=MARK * scale, color=MAGENTA, visible=False)
        return _Pane(solid, wires, mark)

    def _click(self, origin: Float[np.ndarray, " 3"], direction: Float[np.ndarray, " 3"]) -> None:
        sample, panes = self._sample, self._panes
        for pane in panes:
            assert sample is not None
            there = (origin - pane.solid.position) / pane.solid.scale
            hit = clicked_corner(sample.vertices, sample.faces, there, direction)
            if hit is not None:
                self._clicked(sample, *hit)
                return

    def _joined(self, client: viser.ClientHandle) -> None:
        client.camera.on_update(self._turned)

    def _turned(self, camera: viser.CameraHandle) -> None:
        right, down, forward = viser.transforms.SO3(camera.wxyz).as_matrix().T
        self._axes = np.stack([right, -down, -forward])
        self._place()

    def _place(self) -> None:
        """The light comes from where `render` has it, two meshes are side by side, however the camera is turned."""
        self._lamp.position = tuple(LIGHT @ self._axes)
        shifts: list[Float[np.ndarray, " 3"]] = [-APART * self._axes[0], APART * self._axes[0]]
        for pane, shift in zip(self._panes, shifts if len(self._panes) > 1 else [np.zeros(3)], strict=False):
            pane.solid.position = shift
