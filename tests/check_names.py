#!/usr/bin/env python3
"""Holds every file to including what it names, so that it compiles wherever it stands in a batch, and alone; and every
type to a name of its own: of two that share one, a program takes the functions of either for both.

Looks at words, not at meaning: a name of the table below, or a type of ours, must come from a header that the file
includes itself, or that headers of ours among them include. tests/check_headers.py is sure, for it compiles, and slow.
"""
import functools
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent

# header: what it gives, as a pattern behind its namespace. A name of several headers may come from any of them.
STANDARD = {
    "algorithm": "sort|stable_sort|max|min|clamp|all_of|any_of|none_of|find|find_if|count|count_if|lower_bound|upper_bound|"
                 "nth_element|max_element|min_element|minmax|minmax_element|unique|reverse|includes|is_sorted|fill|copy|copy_n|"
                 "copy_if|partial_sort|stable_partition|transform|shuffle|set_difference|set_union|remove_if|inplace_merge|"
                 "generate|for_each|equal|adjacent_find|ranges",
    "array": "array|to_array", "atomic": "atomic|memory_order_\\w+", "bit": "bit_cast|popcount|bit_width|bit_ceil|countr_zero|endian",
    "charconv": "from_chars|to_chars", "chrono": "chrono", "complex": "complex|polar", "condition_variable": "condition_variable",
    "cmath": "sqrt|floor|ceil|cos|sin|tan|pow|hypot|lround|llround|round|atan2|atan|acos|asin|exp|exp2|log|log2|log10|log1p|"
             "isfinite|isnan|isinf|remainder|nan|nanf|nextafter|fmod|fmin|fmax|nearbyint|ldexp|signbit|copysign|erfc",
    "csignal": "signal|raise", "cstdarg": "va_list", "cstddef": "byte|nullptr_t|ptrdiff_t",
    "cstdint": "u?int(?:8|16|32|64|max|ptr)_t", "cstdio": "f?printf|snprintf|FILE|f(?:open|close|flush|getc|gets|read|write)",
    "cstdlib": "abort|exit|atoi|atof|getenv|strtoul", "cstring": "memcpy|memcmp|memset|strerror|strlen",
    "deque": "deque", "exception": "exception", "filesystem": "filesystem", "fstream": "ifstream|ofstream|fstream",
    "functional": "function|less|greater|ref|bind|hash", "iostream": "cout|cerr|cin", "iterator": "back_inserter|make_move_iterator|"
    "istreambuf_iterator|distance|advance|next|prev|ssize", "limits": "numeric_limits", "list": "list", "map": "map|multimap",
    "memory": "shared_ptr|unique_ptr|weak_ptr|make_shared|make_unique", "mutex": "mutex|lock_guard|unique_lock",
    "numbers": "numbers", "numeric": "iota|accumulate", "optional": "optional|nullopt", "queue": "queue|priority_queue",
    "random": "mt19937(?:_64)?|uniform_\\w+|normal_distribution|minstd_rand|random_device|seed_seq|geometric_distribution",
    "regex": "regex\\w*|smatch", "set": "set|multiset", "span": "span", "sstream": "[io]?stringstream", "stdexcept": "runtime_error",
    "string": "string|to_string|getline|sto\\w+", "system_error": "error_code|errc|system_error", "thread": "thread|this_thread",
    "tuple": "tuple|tie|tuple_size_v", "type_traits": "is_\\w+_v|conditional_t|decay_t|enable_if_t|make_unsigned_t|remove_cv_t",
    "unordered_set": "unordered_set", "utility": "move|pair|exchange|swap|make_pair", "variant": "variant|get_if|visit",
    "vector": "vector",
}
ABSEIL = {
    "status/status.h": "Status|StatusCode|OkStatus|\\w+Error|Is[A-Z]\\w+",
    "status/statusor.h": "StatusOr", "strings/str_cat.h": "StrCat|StrAppend|Hex", "strings/str_format.h": "StrFormat|StreamFormat|"
    "StrAppendFormat", "strings/str_split.h": "StrSplit|MaxSplits|SkipEmpty|SkipWhitespace|ByAnyChar", "strings/str_join.h": "StrJoin",
    "strings/string_view.h": "string_view", "strings/numbers.h": "SimpleAto\\w", "strings/match.h": "StartsWith|EndsWith|StrContains",
    "strings/strip.h": "(?:Consume|Strip)(?:Prefix|Suffix)", "strings/ascii.h": "ascii_\\w+|AsciiStrTo\\w+|StripAsciiWhitespace",
    "strings/escaping.h": "HexStringToBytes|BytesToHexString|CHexEscape|WebSafeBase64\\w+", "time/time.h": "Time|Duration|(?:Milli|"
    "Micro|Nano)?[sS]econds|Minutes|Hours|\\w+Duration|(?:To|From)Unix\\w+|Infinite\\w+|FormatTime|ParseTime", "time/clock.h": "Now|SleepFor",
    "synchronization/mutex.h": "Mutex|MutexLock|Condition", "synchronization/notification.h": "Notification",
    "functional/function_ref.h": "FunctionRef", "container/btree_set.h": "btree_set", "container/btree_map.h": "btree_map",
    "container/flat_hash_map.h": "flat_hash_map", "container/flat_hash_set.h": "flat_hash_set", "cleanup/cleanup.h": "Cleanup",
}
GIVES_ALSO = {"absl/status/statusor.h": ["absl/status/status.h"], "absl/time/clock.h": ["absl/time/time.h"],
              "absl/strings/str_format.h": ["cstdio"], "iostream": ["ostream", "istream"]}
# What of a library needs some header of it.
FAMILIES = {r"\bEigen::": r"Eigen/", r"\bgrpc::": r"grpc", r"\bgoogle::protobuf::": r"google/protobuf/|.*\.pb\.h",
            r"\bCLI::": r"CLI/", r"\bnlohmann::": r"nlohmann/", r"\bceres::": r"ceres/", r"\bpcl::": r"pcl/",
            r"\bTEST(?:_[FP])?\(": r"gtest/", r"\b(?:MOCK_METHOD|EXPECT_CALL)\(": r"gmock/", r"\b(?:LOG|CHECK)\(": r"glog/",
            r"\bv1::": r".*\.pb\.h"}
INCLUDE = re.compile(r'^\s*#\s*include\s*[<"]([^>"]+)[>"]', re.M)
NOT_CODE = re.compile(r'//[^\n]*|R"(\w*)\(.*?\)\1"|"(?:[^"\\\n]|\\.)*"|^\s*#\s*include[^\n]*|/\*.*?\*/', re.M | re.S)
HIDDEN = re.compile(r"^namespace \{\n.*?^\}  // namespace\n", re.M | re.S)
DEFINED = re.compile(r"^(?:struct|class|enum class|enum)\s+(\w+)\s*(?:final\s*)?(?::[^:{;][^{;]*)?\{", re.M)
TYPE = re.compile(r"^(?:template <[^>]*>\s*)?(?:struct|class|enum class|enum)\s+(?:\[\[\w+\]\]\s+)?(\w+)[^;{]*\{", re.M)


@functools.cache
def text(path):
    return (ROOT / path).read_text(encoding="utf-8")


@functools.cache
def code(path):
    return NOT_CODE.sub("", text(path))


@functools.cache
def closure(path):
    """What `path` includes, and what headers of ours among that include; a source has what its own header has."""
    reached, open_ = set(), list(INCLUDE.findall(text(path)))
    while open_:
        header = open_.pop()
        if header in reached:
            continue
        reached.add(header)
        reached.update(GIVES_ALSO.get(header, ()))
        if (ROOT / header).is_file():
            open_ += INCLUDE.findall(text(header))
    return frozenset(reached)


@functools.cache
def types_within(path):
    """Types the file declares, inside others too."""
    return frozenset(re.findall(r"\b(?:struct|class|enum|using|typename)\s+(?:class\s+)?(\w+)", code(path)))


def type_owners(headers):
    owners = {}
    for header in headers:
        for name in TYPE.findall(code(header)):
            owners.setdefault(name, set()).add(header)
    return owners


def same_names(paths):
    """Types outside unnamed namespaces that two files define in one namespace."""
    owners = {}
    for path in paths:
        open_code = HIDDEN.sub("", text(path))
        space = re.search(r"^namespace ([\w:]+) \{", open_code, re.M)
        for name in DEFINED.findall(open_code):
            owners.setdefault((space.group(1) if space else "", name), []).append(path)
    for (space, name), files in owners.items():
        if len(files) > 1:
            yield f"{' and '.join(files)}: both define {space}::{name}"


def faults(path, tables, owners):
    has = closure(path)
    for name in sorted(set(re.findall(r"\b(?:std|absl)::\w+", code(path)))):
        for pattern, header in tables:
            if pattern.fullmatch(name) and header not in has:
                yield f"{path}: names {name}: include {header}"
    for pattern, header in FAMILIES.items():
        found = re.search(pattern, code(path))
        if found and not any(re.match(header, h) for h in has):
            yield f"{path}: names {found.group(0)} and includes nothing of {header}"
    words = set(re.findall(r"(?<![\w.>:])([A-Z]\w+)(?=[\s&*>{:,]|$)", code(path)))
    declared = set().union(*(types_within(p) for p in (path, *has) if (ROOT / p).is_file()))
    for name in sorted(words & owners.keys() - declared):
        if not re.search(rf"\b{name}\s*\(", code(path)):
            yield f"{path}: names {name}: include {sorted(owners[name])[0]}"


def main():
    listed = subprocess.run(["git", "ls-files", *(f"{f}/*.{e}" for f in ("core", "server", "client", "proto", "tests")
                             for e in ("h", "cc"))], cwd=ROOT, check=True, capture_output=True, text=True).stdout.split()
    tables = [(re.compile(rf"std::(?:{names})"), header) for header, names in STANDARD.items()]
    tables += [(re.compile(rf"absl::(?:{names})"), f"absl/{header}") for header, names in ABSEIL.items()]
    owners = type_owners([path for path in listed if path.endswith(".h")])
    found = [*same_names(listed), *(fault for path in listed for fault in faults(path, tables, owners))]
    print("\n".join(found) if found else f"names: {len(listed)} files, each includes what it names, no type defined twice")
    return 1 if found else 0


sys.exit(main())
