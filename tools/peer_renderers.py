#!/usr/bin/env python3
"""The renderers that tools/peers lays Isolume beside, each to be run in a process of its own.

    tools/peer_renderers.py FOLDER mitsuba SCENE CPU_SECONDS PICTURE [VARIANT RR_DEPTH]
    tools/peer_renderers.py FOLDER cycles CPU_SECONDS PICTURE     the 128³ cloud
    tools/peer_renderers.py FOLDER vtk                            a 256³ cloud; seconds a frame

SCENE and PICTURE (an EXR file) lie in FOLDER. The last line on stdout is JSON. CPU seconds are those of
all threads while a picture is rendered: starting, importing and building the scene are left out.

RR_DEPTH is the event of a path from which on Mitsuba plays Russian roulette, null collisions included. What
stands in MITSUBA gives the least error in the same time, which the last two arguments let one check; a
variant llvm_ad_rgb needs LLVM 19 (DRJIT_LIBLLVM_PATH). In the cloud, paths end after 63 scatterings.
"""

import json
import math
import sys
import time
import tomllib
from importlib.machinery import SourceFileLoader
from importlib.util import module_from_spec, spec_from_loader
from pathlib import Path

# Scripts without an ending are imported below; they shall leave nothing behind.
sys.dont_write_bytecode = True

TOOLS = Path(__file__).resolve().parent
CLOUD, HEAD = "cloud128-sun.toml", "head.toml"
SIZE, FRAME = 128, 512
SCATTERINGS = 63
NEVER = 1_000_000
MITSUBA = {CLOUD: {"max_depth": SCATTERINGS + 1, "rr_depth": NEVER}, HEAD: {"rr_depth": 5}}
FRAMES = 12
DENSITY = 61.0939
ISOVALUE = 0.3


def tool(name):
    """A script of this folder as a module."""
    loader = SourceFileLoader(name, str(TOOLS / name))
    module = module_from_spec(spec_from_loader(name, loader))
    loader.exec_module(module)
    return module


def read(folder, name):
    """A scene and its values, [z, y, x]."""
    import numpy as np

    scene = tomllib.loads((folder / name).read_text())
    scene["camera"].setdefault("up", [0.0, 1.0, 0.0])
    scene["render"]["size"] = [SIZE, SIZE]
    return scene, np.load(folder / scene["volume"]["path"])


def save(path, picture):
    import numpy as np
    import OpenEXR

    channels = {c: np.ascontiguousarray(picture[..., i], np.float32) for i, c in enumerate("RGB")}
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    with OpenEXR.File(header, channels) as file:
        file.write(str(path))


def mitsuba(folder, name, cpu_seconds, picture, variant="scalar_rgb", rr_depth=None):
    """Batch after batch of four samples, and from their spread the standard error."""
    import mitsuba as mi
    import numpy as np

    mi.set_variant(variant)
    reference = tool("mitsuba_reference")
    scene, data = read(folder, name)
    translation = reference.Translation(
        mi, scene, data.astype(np.float32), np.array(scene["volume"]["spacing"]), 1)
    if not translation.exact:
        sys.exit(f"{name}: Mitsuba and Isolume interpolate different media")
    integrator = translation.scene["integrator"]
    integrator |= MITSUBA[name]
    if rr_depth is not None:
        integrator["rr_depth"] = int(rr_depth)
    loaded = mi.load_dict(translation.scene)
    mi.render(loaded, spp=1, seed=1)
    batches, took, began = [], 0.0, time.perf_counter()
    while took < float(cpu_seconds) or len(batches) < 2:
        start = time.process_time()
        batches.append(np.array(mi.render(loaded, spp=4, seed=7919 * (len(batches) + 2)), np.float64))
        took += time.process_time() - start
    wall = time.perf_counter() - began
    spread = np.std(batches, 0, ddof=1) / math.sqrt(len(batches))
    said = f"Mitsuba {mi.__version__} {variant}, roulette from {integrator['rr_depth']} on"
    reference.write_exr(folder / picture, np.mean(batches, 0), spread, said)
    return {"name": f"Mitsuba {mi.__version__}", "cpu_s": took, "wall_s": wall, "spp": 4 * len(batches)}


def cycles(folder, cpu_seconds, picture):
    """One render of as many samples as fit; what a render costs besides samples is left out."""
    import bpy
    import numpy as np

    scene, data = read(folder, CLOUD)
    cycles_scene(bpy, scene, write_vdb(bpy, folder, data, scene["volume"]["spacing"][0]))

    def shoot(samples, seed):
        bpy.context.scene.cycles.samples, bpy.context.scene.cycles.seed = samples, seed
        start = time.process_time()
        bpy.ops.render.render(write_still=True)
        return time.process_time() - start

    bpy.context.scene.render.filepath = str(folder / "cycles_raw.exr")
    shoot(1, 1)
    fixed = min(shoot(1, 2), shoot(1, 3))
    each = (shoot(17, 4) - fixed) / 16
    samples = max(1, round(float(cpu_seconds) / each))
    took = shoot(samples, 5) - fixed + each
    image = bpy.data.images.load(str(folder / "cycles_raw.exr"))
    pixels = np.array(image.pixels, np.float32).reshape(SIZE, SIZE, -1)
    save(folder / picture, pixels[::-1, :, :3])
    return {"name": f"Cycles {bpy.app.version_string}", "cpu_s": took, "spp": samples}


def write_vdb(bpy, folder, data, voxel):
    """As OpenVDB, with index 0 at the first cell's centre."""
    import numpy as np

    # From bpy/5.0/scripts/modules/bpy/__init__.py to what the wheel carries off the usual path.
    sys.path += map(str, Path(bpy.__file__).parents[3].glob("python/lib/python*/site-packages"))
    import openvdb

    grid = openvdb.FloatGrid()
    grid.copyFromArray(np.ascontiguousarray(data.transpose(2, 1, 0)))
    grid.name = "density"
    matrix = np.diag([voxel, voxel, voxel, 1.0])
    matrix[3, :3] = voxel * (1 - np.array(data.shape[::-1])) / 2
    grid.transform = openvdb.createLinearTransform(matrix.tolist())
    path = folder / "cloud128.vdb"
    openvdb.write(str(path), grids=[grid])
    return path


def cycles_scene(bpy, scene, vdb):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    root = bpy.context.scene
    bpy.ops.object.volume_import(filepath=str(vdb), align="WORLD", location=(0, 0, 0))
    volume = bpy.context.object
    volume.data.render.precision, volume.data.render.clipping = "FULL", 0.0
    volume.data.materials.append(cycles_medium(bpy, scene["medium"]))

    root.world = bpy.data.worlds.new("sky")
    root.world.use_nodes = True
    background = root.world.node_tree.nodes["Background"].inputs
    for light in scene["light"]:
        if light["type"] == "environment":
            background[0].default_value, background[1].default_value = (*light["radiance"], 1), 1
        else:
            sun = bpy.data.lights.new("sun", "SUN")
            sun.energy, sun.angle = light["irradiance"][0], 0
            place(bpy, root, "sun", sun, (0, 0, 0), light["direction"])
    camera = bpy.data.cameras.new("camera")
    camera.sensor_fit, camera.angle = "VERTICAL", math.radians(scene["camera"]["fov_y"])
    eye, target = scene["camera"]["eye"], scene["camera"]["target"]
    forward = [t - e for t, e in zip(target, eye)]
    root.camera = place(bpy, root, "camera", camera, eye, forward)
    cycles_settings(root)


def cycles_medium(bpy, medium):
    """Scattering and absorption of one density, whose sum is the extinction."""
    material = bpy.data.materials.new("medium")
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    density = tree.nodes.new("ShaderNodeAttribute")
    density.attribute_name = "density"
    both = tree.nodes.new("ShaderNodeAddShader")
    albedo = medium["transfer"][-1]["color"][0]
    for i, (kind, color, share) in enumerate((("Scatter", 1, albedo), ("Absorption", 0, 1 - albedo))):
        shader = tree.nodes.new(f"ShaderNodeVolume{kind}")
        shader.inputs["Color"].default_value = (color, color, color, 1)
        scale = tree.nodes.new("ShaderNodeMath")
        scale.operation = "MULTIPLY"
        scale.inputs[1].default_value = medium["density"] * share
        tree.links.new(density.outputs["Fac"], scale.inputs[0])
        tree.links.new(scale.outputs[0], shader.inputs["Density"])
        tree.links.new(shader.outputs[0], both.inputs[i])
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(both.outputs[0], output.inputs["Volume"])
    return material


def place(bpy, root, name, data, location, forward):
    """A camera and a light look along their -z."""
    from mathutils import Matrix, Vector

    thing = bpy.data.objects.new(name, data)
    root.collection.objects.link(thing)
    back = -Vector(forward).normalized()
    right = Vector((0, 1, 0)).cross(back).normalized()
    turn = Matrix((right, back.cross(right), back)).transposed().to_4x4()
    turn.translation = location
    thing.matrix_world = turn
    return thing


def cycles_settings(root):
    root.render.engine = "CYCLES"
    render, settings = root.render, root.cycles
    render.resolution_x = render.resolution_y = SIZE
    render.resolution_percentage = 100
    render.image_settings.file_format = "OPEN_EXR"
    render.image_settings.color_depth = "32"
    settings.use_adaptive_sampling = settings.use_denoising = settings.volume_biased = False
    settings.max_bounces = settings.volume_bounces = SCATTERINGS
    settings.min_light_bounces = SCATTERINGS
    settings.sample_clamp_direct = settings.sample_clamp_indirect = 0
    settings.light_sampling_threshold = 0
    settings.pixel_filter_type, settings.filter_width = "BOX", 1.0


def vtk(folder):
    """Wall and CPU seconds a frame, by mode."""
    import numpy as np
    import vtk as v
    from vtk.util.numpy_support import numpy_to_vtk

    data = np.load(folder / "cloud256.npy")
    voxel = 2.0 / data.shape[0]
    image = v.vtkImageData()
    image.SetDimensions(*data.shape[::-1])
    image.SetSpacing(voxel, voxel, voxel)
    image.SetOrigin(*[voxel * (1 - n) / 2 for n in data.shape[::-1]])
    image.GetPointData().SetScalars(numpy_to_vtk(data.ravel(), deep=True))
    result = {"name": f"VTK {v.vtkVersion().GetVTKVersion()}"}
    for mode in ("march", "surface"):
        frames = list(vtk_frames(v, image, voxel, mode))
        wall, cpu = (median(times) for times in zip(*frames))
        result[mode] = {"seconds": wall, "cpu_s": cpu}
    return result


def vtk_frames(v, image, voxel, mode):
    mapper, look = v.vtkGPUVolumeRayCastMapper(), v.vtkVolumeProperty()
    mapper.SetInputData(image)
    look.SetInterpolationTypeToLinear()
    opacity = v.vtkPiecewiseFunction()
    if mode == "surface":
        mapper.SetBlendModeToIsoSurface()
        look.GetIsoSurfaceValues().SetValue(0, ISOVALUE)
        look.ShadeOn()
        opacity.AddPoint(0, 1)
    else:
        # The same extinction as Isolume's, by the voxel.
        for i in range(33):
            opacity.AddPoint(i / 32, 1 - math.exp(-DENSITY * i / 32 * voxel))
        look.SetScalarOpacityUnitDistance(voxel)
    look.SetScalarOpacity(opacity)
    volume = v.vtkVolume()
    volume.SetMapper(mapper)
    volume.SetProperty(look)
    renderer, window = v.vtkRenderer(), v.vtkRenderWindow()
    renderer.AddVolume(volume)
    window.SetOffScreenRendering(1)
    window.SetSize(FRAME, FRAME)
    window.AddRenderer(renderer)
    camera = renderer.GetActiveCamera()
    camera.SetPosition(0.8, 0.6, 3.2)
    camera.SetFocalPoint(0, 0, 0)
    camera.SetViewAngle(40)
    renderer.ResetCameraClippingRange()
    window.Render()
    for _ in range(FRAMES):
        camera.Azimuth(360 / FRAMES)
        start = time.perf_counter(), time.process_time()
        window.Render()
        window.WaitForCompletion()
        yield time.perf_counter() - start[0], time.process_time() - start[1]


def median(values):
    values = sorted(values)
    return values[len(values) // 2]


def main():
    folder, peer, *words = sys.argv[1:]
    render = {"mitsuba": mitsuba, "cycles": cycles, "vtk": vtk}[peer]
    print(json.dumps(render(Path(folder), *words)))


if __name__ == "__main__":
    main()
