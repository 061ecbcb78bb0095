"""Durable background work on a map."""
import contextlib
from collections.abc import Callable

from strata import errors, job
from strata.aio.calls import MapCalls
from strata.job import Job, JobParameter
from strata.v1 import jobs_pb2

Progress = Callable[[Job], object] | None
"""Called at every change, some ten times a second at most."""


class Jobs(MapCalls):
    async def start_job(self, /, kind: str, **parameters: JobParameter) -> Job:
        """Queues a Job of a kind that `strata job start --help` lists, with its parameters."""
        answer = await self._connection.once(self._jobs.Start, jobs_pb2.StartJobRequest(
            map=self.name, kind=kind, parameters=job.parameters(parameters)))
        return job.from_proto(answer.job)

    async def find_job(self, number: int) -> Job:
        """A Job as it is now, by its id; NotFound."""
        answer = await self._connection.unary(self._jobs.Get, jobs_pb2.GetJobRequest(map=self.name, id=number))
        return job.from_proto(answer.job)

    async def follow_job(self, which: Job, progress: Progress = None) -> Job:
        """The Job once it has ended; progress(job) is called at every change, some ten times a second at most.

        Raises FailedPrecondition if it failed or was cancelled.
        """
        request = jobs_pb2.WatchJobRequest(map=self.name, id=which.id)
        backoff = self._connection.new_backoff()
        while not which.ended:
            try:
                async with contextlib.aclosing(self._connection.stream(self._jobs.Watch, request, endless=True)) as answers:
                    async for answer in answers:
                        which = job.from_proto(answer.job)
                        backoff = self._connection.new_backoff()
                        if progress is not None:
                            progress(which)
            except errors.StrataError as failure:
                await self._connection.wait(backoff, failure)
        if which.state not in ("succeeded", "proposed"):
            raise errors.FailedPrecondition(f"{which.kind} job {which.id} {which.state}: {which.message}")
        return which

    async def job(self, /, kind: str, *, progress: Progress = None, **parameters: JobParameter) -> Job:
        """Starts a Job and follows it to its end: map.job("optimize", rounds=3)."""
        return await self.follow_job(await self.start_job(kind, **parameters), progress)

    async def optimize(self, /, *, progress: Progress = None, **parameters: JobParameter) -> Job:
        """Makes all poses globally consistent; map.job("optimize", …)."""
        return await self.job("optimize", progress=progress, **parameters)

    async def jobs(self) -> list[Job]:
        """All Jobs, by id."""
        answer = await self._connection.unary(self._jobs.List, jobs_pb2.ListJobsRequest(map=self.name))
        return [job.from_proto(message) for message in answer.jobs]

    async def cancel_job(self, which: Job) -> Job:
        """Asks a Job to end."""
        answer = await self._connection.unary(self._jobs.Cancel, jobs_pb2.CancelJobRequest(map=self.name, id=which.id))
        return job.from_proto(answer.job)

    async def accept_job(self, which: Job) -> Job:
        """Makes what is proposed real; the Job, queued again."""
        answer = await self._connection.once(self._jobs.Accept, jobs_pb2.AcceptJobRequest(map=self.name, id=which.id))
        return job.from_proto(answer.job)

    async def revert_job(self, which: Job) -> Job:
        """Forgets a proposal, or undoes what a Job did; the Job that is cancelled, or the new one that undoes."""
        answer = await self._connection.once(self._jobs.Revert, jobs_pb2.RevertJobRequest(map=self.name, id=which.id))
        return job.from_proto(answer.job)
