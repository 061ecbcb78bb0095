"""The client for asyncio: the same nouns and verbs as `strata`, to be awaited.

    async with await strata.aio.connect("127.0.0.1:50051") as db:
        campus = await db.map("campus")
        path, tiles = await asyncio.gather(campus.plan((0, 0), (9, 9)), campus.fetch())
        async for change in campus.watch():
            print(change.epoch)

Errors, arguments and answers are those of `strata`, whose blocking methods are made of these. Objects belong to the event
loop that they were made in.
"""
from strata.aio.database import Database, connect
from strata.aio.map import Map
from strata.aio.tracking import Tracking

__all__ = ["Database", "Map", "Tracking", "connect"]
