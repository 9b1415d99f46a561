"""The Python module as its users see it."""
import ast
import gc
import json
import os
import pathlib
import tempfile
import threading
import unittest
import warnings

import skipping

skipping.unless_built()

import numpy as np

import lodestone


def tetrahedron():
    positions = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=np.float32)
    return positions, np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], dtype=np.uint32)


def sphere(triangles=4000):
    made = lodestone.generate("sphere", triangles)
    positions = made.positions / np.linalg.norm(made.positions, axis=1, keepdims=True)
    colours = np.concatenate([np.rint(127.5 + 120 * positions), np.full((len(positions), 1), 255)], axis=1).astype(np.uint8)
    return lodestone.Mesh(positions, made.triangles, colours=colours)


OPTIONS = dict(backends=["lod", "vgi", "full"], order="static", resolution=33, clusters=8)
ASSET = lodestone.bake(sphere(), **OPTIONS)


class Meshes(unittest.TestCase):
    def test_are_the_arrays_they_were_made_of(self):
        positions, triangles = tetrahedron()
        for given in (triangles, triangles.astype(np.int32), triangles.astype(np.int64), triangles.tolist(), np.asfortranarray(triangles)):
            mesh = lodestone.Mesh(positions, given)
            np.testing.assert_array_equal(mesh.positions, positions)
            np.testing.assert_array_equal(mesh.triangles, triangles)
            self.assertEqual(mesh.triangles.dtype, np.uint32)
        self.assertIsNone(mesh.normals)
        np.testing.assert_allclose(lodestone.Mesh(positions.astype(np.float64), triangles).positions, positions)

    def test_hand_out_their_memory_and_outlive_their_names(self):
        mesh = lodestone.Mesh(*tetrahedron(), normals=np.ones((4, 3)))
        positions = mesh.positions
        self.assertFalse(positions.flags.owndata)
        self.assertFalse(positions.flags.writeable)
        self.assertEqual(positions.ctypes.data, mesh.positions.ctypes.data)
        np.testing.assert_allclose(mesh.normals, np.full((4, 3), 3**-0.5), rtol=1e-6)
        del mesh
        gc.collect()
        np.testing.assert_array_equal(positions, tetrahedron()[0])

    def test_of_wrong_arrays_are_refused_by_name(self):
        positions, triangles = tetrahedron()
        nan = positions.copy()
        nan[2, 1] = np.nan
        for arguments, said in [
            ((positions[:, :2], triangles), r"positions: must have the shape \(n, 3\)"),
            ((positions, triangles[:, :2]), r"triangles: must have the shape \(n, 3\)"),
            ((positions, triangles.astype(float)), "triangles: must be whole numbers"),
            ((positions, triangles.astype(np.int64) - 1), "triangles: -1 is no vertex"),
            ((positions, triangles.astype(np.int64) + 2**40), "is no vertex"),
            ((positions, triangles.astype(np.int32) - 1), "triangle 0 refers to vertex 4294967295"),
            ((positions, triangles + 4), "triangle 0 refers to vertex 4"),
            ((nan, triangles), "positions: that of vertex 2 is not finite"),
            ((positions[:0], triangles), "there are no vertices"),
            ((positions, triangles[:0]), "triangles: there are none"),
        ]:
            with self.assertRaisesRegex(lodestone.UsageError, said):
                lodestone.Mesh(*arguments)
        with self.assertRaisesRegex(lodestone.UsageError, "normals: there are 3, and 4 vertices"):
            lodestone.Mesh(positions, triangles, normals=np.ones((3, 3)))
        with self.assertRaisesRegex(lodestone.UsageError, "colours: must be of the type uint8"):
            lodestone.Mesh(positions, triangles, colours=np.ones((4, 4)))

    def test_are_written_and_read(self):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "sphere.ply"
            mesh = sphere()
            mesh.write(path)
            again = lodestone.read(path)
            np.testing.assert_array_equal(again.positions, mesh.positions)
            np.testing.assert_array_equal(again.colours, mesh.colours)
            self.assertEqual(again.name, "sphere.ply")
            with self.assertRaisesRegex(lodestone.FormatError, "none.ply"):
                lodestone.read(path.parent / "none.ply")
            with self.assertRaises(lodestone.UsageError):
                mesh.write("a.stl")

    def test_tell_all_of_their_materials(self):
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder)
            vase = lodestone.generate("vase", 500)
            vase.write(folder / "vase.obj")
            image = next(folder.glob("vase-0.*")).name
            library = folder / "vase.mtl"
            library.write_text(library.read_text() + f"Pm 1\nPr 0.25\nKe 1 2 3\nd 0.5\nnorm -bm 0.5 {image}\n")
            read = lodestone.read(folder / "vase.obj")
            (material,) = read.material_table
            self.assertEqual(material["shading"], "metallic_roughness")
            self.assertEqual((material["metallic"], material["roughness"]), (1, 0.25))
            self.assertEqual(material["emission"], (1, 2, 3))
            self.assertEqual((material["alpha_mode"], material["base_colour"][3]), ("blend", 0.5))
            self.assertEqual(material["normal_scale"], 0.5)
            textures = material["textures"]
            self.assertEqual(textures["base_colour"]["image"], material["image"])
            self.assertEqual(textures["normal"]["wrap"], ("repeat", "repeat"))
            np.testing.assert_array_equal(textures["normal"]["place"], [[1, 0, 0], [0, 1, 0]])
            self.assertIsNone(textures["occlusion"])
            self.assertEqual(len(read.images), 1)


    def test_keep_a_second_set_of_texture_coordinates(self):
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder)
            lodestone.generate("vase", 500).write(folder / "vase.obj")
            image = next(folder.glob("vase-0.*")).name

            def tangents(normals):
                across = np.cross(normals, [0.36, 0.48, 0.8])
                across /= np.linalg.norm(across, axis=1, keepdims=True)
                return np.hstack([across, -np.ones((len(across), 1))])

            def read(second):
                mesh = sphere(600)
                normals = mesh.positions / np.linalg.norm(mesh.positions, axis=1, keepdims=True)
                arrays = [mesh.positions, mesh.positions[:, :2], second(mesh.positions), normals, tangents(normals)]
                binary = b"".join(a.astype(np.float32).tobytes() for a in arrays) + mesh.triangles.tobytes()
                offsets = np.cumsum([0] + [4 * a.size for a in arrays])
                counts = [len(a) for a in arrays] + [mesh.triangles.size]
                document = {
                    "asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
                    "buffers": [{"byteLength": len(binary), "uri": "m.bin"}],
                    "bufferViews": [{"buffer": 0, "byteOffset": int(o), "byteLength": len(binary) - int(o)} for o in offsets],
                    "accessors": [{"bufferView": i, "componentType": 5125 if i == 5 else 5126, "count": counts[i],
                                   "type": ("VEC3", "VEC2", "VEC2", "VEC3", "VEC4", "SCALAR")[i]} for i in range(6)],
                    "images": [{"uri": image}], "textures": [{"source": 0}],
                    "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}},
                                   "normalTexture": {"index": 0}, "occlusionTexture": {"index": 0, "texCoord": 1}}],
                    "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1, "TEXCOORD_1": 2,
                                                               "NORMAL": 3, "TANGENT": 4},
                                                "indices": 5, "material": 0}]}]}
                (folder / "m.bin").write_bytes(binary)
                (folder / "m.gltf").write_text(json.dumps(document))
                return lodestone.read(folder / "m.gltf")

            first = read(lambda p: p[:, 1:])
            self.assertEqual([t and t["second"] for t in first.material_table[1]["textures"].values()],
                             [False, None, False, True, None])
            np.testing.assert_array_equal(first.second_uvs, first.positions[:, 1:])
            asset = lodestone.bake(first, backends=["lod"], order="static")
            lodestone.simplify(first, triangles=200).write(folder / "small.glb")
            for made in (lodestone.simplify(first, triangles=200), asset.extract("lod", level=len(asset.levels("lod").triangles) // 2),
                         lodestone.read(folder / "small.glb")):
                np.testing.assert_array_equal(made.second_uvs, made.positions[:, 1:])
                np.testing.assert_allclose(made.tangents, tangents(made.normals), atol=2e-3)
            self.assertIsNone(sphere().second_uvs)
            self.assertIsNone(sphere().tangents)


class Simplification(unittest.TestCase):
    def test_comes_under_a_triangle_count_or_an_error(self):
        mesh = sphere()
        for simplifier in ("quadric", "openmesh"):
            self.assertTrue(396 <= len(lodestone.simplify(mesh, triangles=400, simplifier=simplifier).triangles) <= 400)
        within = lodestone.simplify(mesh, error=0.01)
        self.assertLess(len(within.triangles), 2000)
        self.assertLess(lodestone.distance(mesh, within).max, 0.0105)
        self.assertIsNotNone(within.colours)
        with self.assertRaisesRegex(lodestone.UsageError, "either a number of triangles or an error"):
            lodestone.simplify(mesh)

    def test_is_stopped_by_what_progress_raises(self):
        stages = []

        def progress(stage, fraction):
            stages.append(stage)
            self.assertTrue(0 <= fraction <= 1)
            if len(stages) == 2:
                raise KeyboardInterrupt

        with self.assertRaises(KeyboardInterrupt):
            lodestone.simplify(sphere(), triangles=100, progress=progress)
        with self.assertRaises(KeyboardInterrupt):
            stages.clear()
            lodestone.bake(sphere(), progress=progress)


class Unwrapping(unittest.TestCase):
    def test_lays_the_surface_into_a_square(self):
        mesh = sphere()
        stages = []
        made, report = lodestone.unwrap(mesh, resolution=512, charts=12, progress=lambda stage, fraction: stages.append(stage))
        self.assertIsInstance(made, lodestone.Mesh)
        self.assertEqual(made.uvs.shape, (len(made.positions), 2))
        self.assertTrue((made.uvs >= 0).all() and (made.uvs <= 1).all())
        corners = made.uvs[made.triangles].astype(float)
        a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        areas = np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / 2
        self.assertAlmostEqual(areas.sum(), report["coverage"], delta=1e-4)
        self.assertGreater(report["coverage"], 0.6)
        self.assertEqual((report["flipped_triangles"], report["overlapping_pairs"], report["resolution"]), (0, 0, 512))
        self.assertEqual(report["triangles"], len(made.triangles))
        self.assertLess(lodestone.distance(mesh, made).max, 1e-6)
        self.assertIsNotNone(made.colours)
        self.assertIn("check", stages)

    def test_bakes_textures(self):
        vase = lodestone.generate("vase", 3000)
        made, report = lodestone.unwrap(vase, bake=True, resolution=128, textures=2)
        self.assertEqual([image.shape for image in made.images], [(128, 128, 4)] * 2)
        self.assertTrue(report["baked"])
        self.assertEqual({material["image"] for material in made.material_table} - {None}, {0, 1})

    def test_warns_of_textures_that_an_atlas_holds(self):
        vase = lodestone.generate("vase", 3000)
        asset = lodestone.bake(vase, backends=["lod", "vgi"], order="static", resolution=9, clusters=8, attribute_resolution=17)
        with self.assertWarnsRegex(UserWarning, "textures are baked into the atlas"):
            made = asset.extract("vgi", level=1)
        self.assertEqual((made.uvs is None, made.colours is None), (True, False))
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            asset.extract("lod", level=1)

    def test_refuses_options_by_name_and_is_stopped_by_what_progress_raises(self):
        with self.assertRaisesRegex(lodestone.UsageError, "no-such"):
            lodestone.unwrap(sphere(), no_such=1)
        with self.assertRaisesRegex(lodestone.UsageError, "leave no room"):
            lodestone.unwrap(sphere(), resolution=16, gutter=16)

        def progress(stage, fraction):
            raise KeyboardInterrupt

        with self.assertRaises(KeyboardInterrupt):
            lodestone.unwrap(sphere(), progress=progress)


class Assets(unittest.TestCase):
    def test_open_from_files_and_bytes(self):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "sphere.lode"
            lodestone.bake(sphere(), path, **OPTIONS)
            data = path.read_bytes()
            for asset in (lodestone.open(path), lodestone.open(str(path)), lodestone.open(data), lodestone.open(bytearray(data))):
                self.assertEqual(asset.about, ASSET.about)
                asset.verify()
            self.assertEqual(asset.backends, ["full", "lod", "vgi"])
            with self.assertRaises(lodestone.FormatError):
                lodestone.open(data[:-5])
            with self.assertRaisesRegex(lodestone.FormatError, "none.lode"):
                lodestone.open("none.lode")

    def test_take_the_options_of_the_program(self):
        self.assertEqual(ASSET.about["options"]["resolution"], 33)
        self.assertEqual(ASSET.about["options"]["backends"], ["lod", "vgi", "full"])
        with self.assertRaisesRegex(lodestone.UsageError, "66"):
            lodestone.bake(sphere(), resolution=66)
        with self.assertRaisesRegex(lodestone.UsageError, "no-such"):
            lodestone.bake(sphere(), no_such=1)

    def test_have_levels_that_extract(self):
        for backend in ("lod", "vgi"):
            levels = ASSET.levels(backend)
            # An atlas may be sampled more densely than its source, level 0.
            falls = levels.triangles[1:] if backend == "vgi" else levels.triangles
            self.assertTrue((np.diff(falls.astype(np.int64)) <= 0).all())
            self.assertTrue((np.diff(levels.errors) >= 0).all())
            by_count = ASSET.extract(backend, triangles=500)
            self.assertLessEqual(len(by_count.triangles), 500)
            by_error = ASSET.extract(backend, error=0.05)
            self.assertLess(len(by_error.triangles), levels.triangles[0])
            self.assertLess(np.abs(np.linalg.norm(by_error.positions, axis=1) - 1).max(), 0.06)
            for wrong in (dict(), dict(level=1, error=1), dict(level=1 << 30), dict(error=-1)):
                with self.assertRaises(lodestone.UsageError):
                    ASSET.extract(backend, **wrong)
        np.testing.assert_allclose(ASSET.bounds[0], (0, 0, 0), atol=1e-3)
        self.assertAlmostEqual(ASSET.bounds[1], 1, delta=0.01)

    def test_are_used_by_several_threads(self):
        counts = []
        threads = [threading.Thread(target=lambda: counts.append(len(ASSET.extract("vgi", level=1).triangles))) for _ in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(len(counts), 4)
        self.assertEqual(len(set(counts)), 1)


class Atlases(unittest.TestCase):
    def test_are_images_of_the_surface(self):
        atlas = ASSET.atlas()
        self.assertEqual(atlas.cells, 32)
        self.assertEqual(atlas.sides.shape, (atlas.charts, 4, 2))
        self.assertTrue((atlas.sides[..., 0] >= 0).all(), "a sphere has no boundary")
        for chart in range(atlas.charts):
            positions, lattice = atlas.positions(chart), atlas.lattice(chart)
            side = len(positions)
            self.assertEqual(positions.shape, (side, side, 3))
            self.assertFalse(lattice.flags.owndata)
            np.testing.assert_allclose(positions, np.array(atlas.origin) + atlas.step * lattice, atol=1e-6)
            np.testing.assert_allclose(np.linalg.norm(positions, axis=2), 1, atol=0.02)
            np.testing.assert_allclose(np.linalg.norm(atlas.normals(chart), axis=2), 1, atol=1e-5)
            self.assertGreater((atlas.normals(chart) * positions).sum(axis=2).min(), 0.9)
            colours = atlas.colours(chart)[..., :3].astype(float)
            self.assertLess(np.abs((colours - 127.5) / 120 - positions).max(), 0.2)
        self.assertIsNone(atlas.uvs(0))
        with self.assertRaisesRegex(lodestone.UsageError, "the atlas has charts"):
            atlas.positions(atlas.charts)

    def test_keep_their_memory_for_their_arrays(self):
        lattice = ASSET.atlas().lattice(0)
        before = lattice.copy()
        gc.collect()
        np.testing.assert_array_equal(lattice, before)


class Cuts(unittest.TestCase):
    def test_are_finer_nearby_and_on_the_surface(self):
        for backend in ("lod", "vgi"):
            cutter = ASSET.cutter(backend)
            far, near = cutter.cut((0, 0, 100)), cutter.cut((0, 0, 4))
            self.assertLess(len(far.triangles), len(near.triangles))
            self.assertTrue(near.settled)
            self.assertEqual(near.level is None, backend == "vgi")
            self.assertLess(near.triangles.max(), len(near.vertices))
            used = near.vertices[np.unique(near.triangles)]
            np.testing.assert_allclose(np.linalg.norm(used["position"], axis=1), 1, atol=0.03)
            self.assertGreater((used["position"] * used["normal"]).sum(axis=1).min(), 0.9)
            with self.assertRaisesRegex(lodestone.UsageError, "eye"):
                cutter.cut((0, 0))
            with self.assertRaisesRegex(lodestone.UsageError, "pixel_error"):
                cutter.cut((0, 0, 3), pixel_error=-1)


class Cache(unittest.TestCase):
    def test_costs_what_the_order_costs(self):
        self.assertEqual(lodestone.cache_cost([[0, 1, 2], [2, 1, 3]]), (2.0, 1.0, 4, 2, 4))
        self.assertAlmostEqual(lodestone.acmr(np.arange(9).reshape(3, 3)), 3)
        self.assertLess(ASSET.acmr(), 1.2)
        with self.assertRaises(lodestone.UsageError):
            lodestone.acmr([[0, 1, 2]], "none")


class Pictures(unittest.TestCase):
    def test_show_the_object(self):
        try:
            full = ASSET.render(backend="full", width=160, height=120)
        except lodestone.MachineError as error:
            self.skipTest(f"no Vulkan: {error}")
        self.assertEqual((full.shape, full.dtype), ((120, 160, 4), np.uint8))
        covered = full[..., 3] == 255
        self.assertTrue(covered[60, 80] and not covered[0, 0])
        self.assertTrue(0.3 < covered.mean() < 0.7)
        for backend in ("lod", "vgi"):
            picture = ASSET.render(backend=backend, width=160, height=120, pixel_error=0.5)
            self.assertLess((np.abs(picture[..., :3].astype(int) - full[..., :3]) > 40).mean(), 0.05)
        from_right = ASSET.render(eye=(3, 0, 0), width=160, height=120)
        self.assertGreater(int(from_right[60, 80, 0]), int(from_right[60, 80, 1]), "the sphere is red at x = 1")
        under_sky = ASSET.render(backend="full", eye=(0, 0, 4), target=(0, 1, 0), width=160, height=120, environment="sky")
        self.assertGreater(int(under_sky[0, 0, 2]), int(under_sky[0, 0, 0]) + 20, "the sky is blue")
        with self.assertRaisesRegex(lodestone.Error, "none such.hdr"):
            ASSET.render(width=16, height=16, environment="none such.hdr")
        for wrong in (dict(backend="none"), dict(debug="none such"), dict(width=0), dict(eye=(0, 0, np.nan)), dict(pixel_error=0)):
            with self.assertRaises(lodestone.UsageError):
                ASSET.render(**wrong)
        with self.assertRaisesRegex(lodestone.FormatError, "not baked for discrete"):
            lodestone.bake(sphere(500), backends="vgi", resolution=5).render(backend="discrete", width=16, height=16)


class Documentation(unittest.TestCase):
    def public(self):
        for name in lodestone.__all__:
            thing = getattr(lodestone, name)
            yield name, thing
            for member in vars(thing) if isinstance(thing, type) and thing.__module__.startswith("lodestone") else ():
                if not member.startswith("_") and not issubclass(thing, (tuple, Exception)):
                    yield f"{name}.{member}", vars(thing)[member]

    def test_every_public_name_has_a_docstring(self):
        names = list(self.public())
        self.assertGreater(len(names), 50)
        for name, thing in names:
            text = (thing.__doc__ or "").strip()
            self.assertTrue(text and not text.endswith(") -> None"), f"{name} has no docstring")

    def test_the_stubs_name_what_is_there(self):
        stubs = ast.parse(pathlib.Path(os.environ["LODESTONE_STUBS"]).read_text())
        stubbed = set()
        for node in stubs.body:
            if isinstance(node, (ast.FunctionDef, ast.ClassDef)):
                stubbed.add(node.name)
                methods = [m.name for m in getattr(node, "body", []) if isinstance(m, ast.FunctionDef) and not m.name.startswith("_")]
                stubbed |= {f"{node.name}.{m}" for m in methods}
        self.assertEqual(stubbed, {name for name, _ in self.public()})

    def test_version_is_the_programs(self):
        self.assertRegex(lodestone.__version__, r"^\d+\.\d+\.\d+$")
        self.assertEqual(ASSET.about["program"], "lodestone " + lodestone.__version__)


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    unittest.main()
