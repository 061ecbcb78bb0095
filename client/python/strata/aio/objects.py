"""Things and planes of a map, and what it has learned to tell apart."""
from strata import classifiers, objects, planes
from strata.aio.calls import MapCalls
from strata.arrays import ArrayLike
from strata.classifiers import Classifier
from strata.objects import Entities, InferredPart, Kind
from strata.planes import PlaneModel
from strata.scan import pieces
from strata.v1 import classifiers_pb2, models_pb2, objects_pb2


class Objects(MapCalls):
    async def planes(self) -> PlaneModel:
        """PlaneModel: the walls, floors and slopes that the last job "planes" found; NotFound before there was one.

            campus.job("planes", min_area_m2=4)
            walls = [plane for plane in campus.planes().planes if plane.kind == "wall"]
        """
        request = models_pb2.GetPlaneModelRequest(map=self.name)
        return planes.from_proto(await self._connection.collected(self._models.GetPlaneModel, request))

    async def objects(self, class_id: int = 0, region: ArrayLike | None = None, kind: str = "") -> Entities:
        """Entities: the things that the last job "objects" found; NotFound before there was one.

        class_id: only those of this class; 0: of every class. region: only those that reach into (x0, y0, x1, y1) or
        (x0, y0, z0, x1, y1, z1), map frame [m]. kind: only those of this kind, by name or first digits of its id.

            campus.job("objects", **{"class": "car"})
            long = [car for car in campus.objects() if car.size[0] > 5]
        """
        request = objects_pb2.ListEntitiesRequest(map=self.name, class_id=class_id, region=objects.box_to_proto(region),
                                                  kind=kind)
        return objects.from_proto(await self._connection.collected(self._objects.ListEntities, request))

    async def kinds(self) -> list[Kind]:
        """The kinds of things that the map knows, without their shapes: its library, then those found, without names."""
        answer = await self._connection.unary(self._objects.ListKinds, objects_pb2.ListKindsRequest(map=self.name))
        return [objects.kind_from_proto(kind) for kind in answer.kinds]

    async def kind(self, kind: str) -> Kind:
        """One of them with its shape, by name or first digits of its id; NotFound."""
        answer = await self._connection.unary(self._objects.GetKind, objects_pb2.GetKindRequest(map=self.name, kind=kind))
        return objects.kind_from_proto(answer.kind, answer.shape)

    async def rename_kind(self, kind: str, name: str) -> Kind:
        """Names a kind; it is in the map's library from then on, and later jobs recognise things of it."""
        answer = await self._connection.once(self._objects.RenameKind, objects_pb2.RenameKindRequest(
            map=self.name, kind=kind, name=name))
        return objects.kind_from_proto(answer.kind)

    async def import_kind(self, name: str, class_name: str, points: ArrayLike, vertices: ArrayLike | None = None,
                          triangles: ArrayLike | None = None) -> Kind:
        """Puts a kind into the library: (n, 3) points of its surface, and its mesh if there is one; z up [m].

            golf = campus.kind("golf")
            harbour.import_kind("golf", "car", golf.points)
        """
        answer = await self._connection.once(self._objects.ImportKind, objects_pb2.ImportKindRequest(
            map=self.name, name=name, class_name=class_name,
            shape=objects.shape_to_proto(points, vertices, triangles)))
        return objects.kind_from_proto(answer.kind)

    async def delete_kind(self, kind: str) -> None:
        """Takes a kind out of the library; things of it are of none then."""
        await self._connection.once(self._objects.DeleteKind, objects_pb2.DeleteKindRequest(map=self.name, kind=kind))

    async def inferred(self, class_id: int = 0, region: ArrayLike | None = None,
                       kind: str = "") -> list[InferredPart]:
        """What the last job "complete" inferred of things by others of their kinds, by entity: where nobody looked.

        Arguments as of objects(). NotFound where nothing was inferred since the last job "objects".

            campus.job("complete")
            for part in campus.inferred():
                print(part.entity, len(part.points))
        """
        request = objects_pb2.ListInferredRequest(map=self.name, class_id=class_id, region=objects.box_to_proto(region),
                                                  kind=kind)
        answers = await self._connection.collected(self._objects.ListInferred, request)
        return objects.inferred_from_proto(answers)

    async def classifiers(self) -> list[Classifier]:
        """The Classifiers that the map has, by id; the job "train" makes them, "classify" labels scans by them."""
        answer = await self._connection.unary(self._classifiers.List,
                                              classifiers_pb2.ListClassifiersRequest(map=self.name))
        return [classifiers.from_proto(message) for message in answer.classifiers]

    async def classifier(self, name: str) -> Classifier:
        """One of them; NotFound."""
        answer = await self._connection.unary(self._classifiers.Get, classifiers_pb2.GetClassifierRequest(
            map=self.name, name=name))
        return classifiers.from_proto(answer.classifier)

    async def delete_classifier(self, name: str) -> None:
        """Forgets a classifier; labels that it gave stay."""
        await self._connection.once(self._classifiers.Delete, classifiers_pb2.DeleteClassifierRequest(
            map=self.name, name=name))

    async def export_classifier(self, name: str) -> bytes:
        """A classifier as bytes, to keep or to import elsewhere."""
        answers = await self._connection.collected(self._classifiers.Export, classifiers_pb2.ExportClassifierRequest(
            map=self.name, name=name))
        return b"".join(answer.bytes for answer in answers)

    async def import_classifier(self, name: str, content: bytes) -> Classifier:
        """Keeps a classifier that was exported, under a name of its own. Its classes become those of the map that have
        their names; names that the map has not are added. Raises AlreadyExists, InvalidArgument."""
        start = classifiers_pb2.ImportClassifierStart(map=self.name, name=name)
        requests = [classifiers_pb2.ImportClassifierRequest(start=start)]
        requests += [classifiers_pb2.ImportClassifierRequest(bytes=part) for part in pieces(content)]

        async def attempt() -> classifiers_pb2.ImportClassifierResponse:
            return await self._connection.send(self._classifiers.Import, requests)

        return classifiers.from_proto((await self._connection.where_the_map_is(attempt)).classifier)
