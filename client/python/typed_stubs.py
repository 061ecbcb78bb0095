"""Writes *_pb2_grpc.pyi: what type checkers know of the stubs that gRPC generates without annotations.

    typed_stubs.py PROTO_DIR OUT_DIR strata/v1/maps.proto ...
"""
import pathlib
import re
import sys

_SHAPES = {(False, False): "UnaryUnary", (True, False): "StreamUnary", (False, True): "UnaryStream",
           (True, True): "StreamStream"}
_RPC = re.compile(r"rpc\s+(\w+)\s*\(\s*(stream\s+)?(\w+)\s*\)\s*returns\s*\(\s*(stream\s+)?(\w+)\s*\)", re.S)


def typed_stub(proto, text):
    """The text of the .pyi of one .proto."""
    module = f"{pathlib.PurePath(proto).stem}_pb2"
    code = re.sub(r"//[^\n]*", "", text)
    lines = ["from typing import Any", "from strata import methods", f"from strata.v1 import {module} as pb", ""]
    for service, body in re.findall(r"service\s+(\w+)\s*\{(.*?)\n\}", code, re.S):
        lines += [f"class {service}Stub:", "    def __init__(self, channel: Any) -> None: ..."]
        lines += [f"    {name}: methods.{_SHAPES[bool(many), bool(answers)]}[pb.{request}, pb.{answer}]"
                  for name, many, request, answers, answer in _RPC.findall(body)]
        lines += [f"class {service}Servicer: ...",
                  f"def add_{service}Servicer_to_server(servicer: {service}Servicer, server: Any) -> None: ...", ""]
    return "\n".join(lines)


def main():
    proto_dir, out_dir, *protos = sys.argv[1:]
    for proto in protos:
        text = (pathlib.Path(proto_dir) / proto).read_text(encoding="utf-8")
        out = pathlib.Path(out_dir) / proto.replace(".proto", "_pb2_grpc.pyi")
        out.write_text(typed_stub(proto, text), encoding="utf-8")


if __name__ == "__main__":
    main()
