"""Tiles decoded by numpy, and by the library, beside what the server says; and what hostile bytes come to."""
import os
import random
import subprocess
import unittest
from unittest import mock

import numpy as np
import xxhash

import strata
from strata import native, tiles
from strata.v1 import tiles_pb2, tiles_pb2_grpc
from support import ServerTest


def sealed(blob):
    """The blob with the checksum that its bytes have."""
    return blob[:-8] + xxhash.xxh3_64_intdigest(blob[:-8]).to_bytes(8, "little")


class TileWorld(ServerTest):
    """A simulated drive under and over a bridge, with labels, imported by the command line."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        world = cls.folder / "world"
        subprocess.run([os.environ["STRATA_SIMULATE"], "bridge", world, "--labels", "--step", "4"],
                       check=True, stdout=subprocess.DEVNULL)
        cls.map = cls.db.create_map("drive")
        for robot in ("over", "under"):
            subprocess.run(
                [os.environ["STRATA_PROGRAM"], "--server", cls.server.address, "scan", "import", "drive",
                 world / robot / "scans", "--poses", world / robot / "poses_initial.txt", "--pose-format", "index-tum",
                 "--trajectory", robot, "--align", "off"], check=True, stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL)
        cls.map.wait(timeout=120)
        stub = tiles_pb2_grpc.TilesStub(cls.db.channel)
        cls.encoded = {level: [answer.tile.bytes for answer in stub.Fetch(tiles_pb2.FetchTilesRequest(
            map="drive", area=tiles_pb2.TileArea(level=level)))] for level in (0, 2, 5)}


class TileTest(TileWorld):
    def test_equal_the_servers_decoder_bit_for_bit(self):
        tiles = self.map.fetch()
        decoded = np.concatenate([tile.surfaces for tile in tiles.values()])
        self.assertGreater(len(decoded), 100_000)
        for name, kind in (("vertical", decoded["depth"] > 0),
                           ("of two classes", (decoded["confidence"] > 0) & (decoded["confidence"] < 100))):
            self.assertTrue(kind.any(), name)
        self.assertEqual(set(decoded["traversability"]), {0, 1, 2, 3})
        cells = np.unique(decoded[["x", "y"]])
        asked = np.concatenate(self.map.surfaces(np.stack([cells["x"], cells["y"]], axis=1)))
        order = ["x", "y", "z"]
        decoded, asked = np.sort(decoded, order=order), np.sort(asked, order=order)
        for field in strata.SURFACE.names:
            np.testing.assert_array_equal(decoded[field], asked[field], field)

    def test_colours_are_those_of_the_points_and_equal_the_servers(self):
        coloured = self.db.create_map("coloured")
        random_numbers = np.random.default_rng(7)
        points = np.column_stack([random_numbers.uniform(-6, 6, (40_000, 2)), np.zeros(40_000)])
        points[:, 2] = 0.1 * points[:, 0]
        rgb = np.column_stack([20 * (points[:, 0] + 6), 10 * (points[:, 1] + 6), np.full(len(points), 40)])
        rgb[np.hypot(points[:, 0], points[:, 1]) < 1] = 0  # black
        coloured.upload(points, rgb=rgb.astype(np.uint8), align=False)
        coloured.upload(points[:500] + [30, 0, 0], align=False)
        coloured.wait(timeout=60)
        decoded = np.concatenate([tile.surfaces for tile in coloured.fetch().values()])
        asked = np.concatenate(coloured.surfaces(np.stack([decoded["x"], decoded["y"]], axis=1)))
        np.testing.assert_array_equal(decoded["rgb"], asked["rgb"])
        near = np.abs(decoded["x"]) < 5.9
        known = decoded["rgb"].any(axis=1)
        np.testing.assert_array_equal(known[near], True)
        np.testing.assert_array_equal(known[decoded["x"] > 20], False)
        r = np.hypot(decoded["x"], decoded["y"])
        np.testing.assert_array_equal(decoded["rgb"][r < 0.9], 1)
        bright = near & (r > 1.2)
        expected = np.column_stack([20 * (decoded["x"] + 6), 10 * (decoded["y"] + 6), np.full(len(decoded), 40)])
        self.assertLess(np.abs(decoded["rgb"][bright] - expected[bright]).max(), 8)

    def test_the_library_says_what_numpy_says(self):
        self.assertIsNotNone(native.LIBRARY)
        for blobs in self.encoded.values():
            for blob in blobs:
                by_library, by_numpy = strata.decode_tile(blob, 0.1), tiles.decode_tile_in_numpy(blob, 0.1)
                self.assertEqual((by_library.key, by_library.version, by_library.cell_size),
                                 (by_numpy.key, by_numpy.version, by_numpy.cell_size))
                np.testing.assert_array_equal(by_library.surfaces, by_numpy.surfaces)
                self.assertTrue(by_library.surfaces.flags.writeable)

    def test_without_the_library_numpy_does_it(self):
        blob = self.encoded[0][0]
        expected = strata.decode_tile(blob, 0.1)
        with mock.patch.object(native, "LIBRARY", None):
            np.testing.assert_array_equal(strata.decode_tile(memoryview(blob), 0.1).surfaces, expected.surfaces)

    def test_coarse_levels_are_read_too(self):
        for level in (2, 5):
            tile = strata.decode_tile(self.encoded[level][0], 0.1)
            self.assertEqual((tile.key.level, tile.cell_size), (level, 0.1 * 2**level))
            inside = tile.surfaces["x"] / (256 * tile.cell_size)
            self.assertTrue(((inside > tile.key.x) & (inside < tile.key.x + 1)).all())


class HostileTest(TileWorld):
    """Bytes that are no tile, for either decoder."""

    @staticmethod
    def decode(blob, cell_size):
        return tiles.decode_tile_in_numpy(blob, cell_size)

    def test_every_cut_and_every_changed_byte_is_data_loss(self):
        blob = min(self.encoded[0], key=len)
        for size in range(len(blob)):
            with self.assertRaises(strata.DataLoss):
                self.decode(blob[:size], 0.1)
        for place in range(len(blob)):
            changed = bytearray(blob)
            changed[place] ^= 0x40
            with self.assertRaises(strata.DataLoss):
                self.decode(bytes(changed), 0.1)
        with self.assertRaises(strata.DataLoss):
            self.decode(blob + b"\0", 0.1)

    def test_later_formats_are_unimplemented(self):
        later = bytearray(self.encoded[0][0])
        later[6] = 200
        with self.assertRaises(strata.Unimplemented):
            self.decode(sealed(bytes(later)), 0.1)

    def test_hostile_bytes_with_a_good_checksum_raise_nothing_but_data_loss(self):
        seed = random.randrange(1 << 32)
        print(f"seed {seed}")
        draw = random.Random(seed)
        sources = [blob for blobs in self.encoded.values() for blob in blobs if len(blob) < 8000]
        refused = 0
        for _ in range(1500):
            blob = bytearray(draw.choice(sources))
            for _ in range(draw.choice((1, 1, 2, 8))):
                begin = draw.randrange(12, len(blob) - 8)
                kind = draw.randrange(3)
                if kind == 0:
                    blob[begin] = draw.randrange(256)
                elif kind == 1:
                    del blob[begin:min(begin + draw.randrange(1, 9), len(blob) - 8)]
                else:
                    blob[begin:begin] = draw.randbytes(draw.randrange(1, 9))
            blob[8:12] = (len(blob) - 20).to_bytes(4, "little")
            try:
                tile = self.decode(sealed(bytes(blob)), 0.1)
                self.assertTrue(np.isfinite(tile.surfaces["z"]).all())
            except strata.DataLoss:
                refused += 1
        self.assertGreater(refused, 500)

    def test_a_few_bytes_cannot_claim_much(self):
        def column(packing, size, *more):
            digits = []
            while size > 127:
                digits.append(size & 127 | 128)
                size >>= 7
            return bytes([packing, *digits, size, *more])

        def blob(*columns):
            body = bytes(9) + bytes(8) + b"".join(columns)
            return sealed(b"SST1\1\0\1\0" + len(body).to_bytes(4, "little") + body + bytes(8))

        full = column(1, 16384, 0xFF)
        with self.assertRaisesRegex(strata.DataLoss, "more than 4194304 surfaces"):
            self.decode(blob(full, column(1, 65536, 127)), 0.1)
        with self.assertRaisesRegex(strata.DataLoss, "at most 16384 can be"):
            self.decode(blob(column(1, 1 << 40, 0)), 0.1)
        announced = bytes([0x28, 0xB5, 0x2F, 0xFD, 0xE0, *(1 << 50).to_bytes(8, "little"), 1, 0, 0])
        with self.assertRaisesRegex(strata.DataLoss, "zstd frame"):
            self.decode(blob(column(2, 16384, len(announced), *announced)), 0.1)
        empty = blob(column(1, 16384, 0), *[column(0, 0)] * 18, bytes(1))
        self.assertEqual(len(self.decode(empty, 0.1).surfaces), 0)



class HostileToLibraryTest(HostileTest):
    @staticmethod
    def decode(blob, cell_size):
        return strata.decode_tile(blob, cell_size)


if __name__ == "__main__":
    unittest.main()
