"""Tensors that PyTorch saved (`.pt`, `.pth`), as PACE writes its logs. Nothing in a file is executed: the pickle in it
may build tensors, lists and dictionaries, and names nothing else."""

import io
import math
import pickle
import zipfile
from collections import OrderedDict
from pathlib import Path
from typing import Any

import numpy as np

import kr5
from kr5.logs.log import Log

MAX_PICKLE = 16 << 20  # bytes; what it describes lies beside it
MAX_NUMBERS = 100_000_000  # of a file
STORAGES = {
    "DoubleStorage": "<f8",
    "FloatStorage": "<f4",
    "HalfStorage": "<f2",
    "LongStorage": "<i8",
    "IntStorage": "<i4",
    "ShortStorage": "<i2",
    "CharStorage": "i1",
    "ByteStorage": "u1",
    "BoolStorage": "?",
}
WIDEST = 256  # numbers of a vector


def read_torch(file: Path) -> Log:
    """Every tensor of a row an instant, by its key; `a.b` is the key b of the dictionary a."""
    try:
        content = _load(file)
    except kr5.Error:
        raise
    except Exception as error:  # what zip and pickle raise at damaged bytes is no closed list
        why = str(error).split("\n")[0][:200] or type(error).__name__
        raise kr5.FileError(
            file,
            f"cannot be read as tensors of PyTorch: {why}; expected a dictionary of tensors, saved with torch.save by"
            " PyTorch 1.6 or newer",
        ) from error
    log = Log(file)
    tensors = dict(_tensors("", content))
    for name, values in tensors.items():
        if values.ndim == 3 and values.shape[1] == 1:  # of one robot among many
            values = values[:, 0]
        if values.ndim and len(values) > 1 and values.ndim <= 2 and values.size <= len(values) * WIDEST:
            log.add_vector(name, values, f"{len(values)} rows")
    if not log.columns:
        names = ", ".join(f"{name} {' x '.join(map(str, v.shape))}" for name, v in list(tensors.items())[:8]) or "none"
        raise kr5.FileError(file, f"contains no tensor with a row an instant; its tensors are: {names}")
    return log


def _load(file: Path) -> object:
    if not zipfile.is_zipfile(file):
        raise ValueError("it is no archive of PyTorch 1.6 or newer")
    with zipfile.ZipFile(file) as archive:
        members = {member.filename: member for member in archive.infolist()}
        name = next((n for n in members if n.split("/")[-1] == "data.pkl"), None)
        if name is None:
            raise ValueError("it holds no data.pkl")
        if members[name].file_size > MAX_PICKLE:
            raise ValueError(f"its description is larger than {MAX_PICKLE >> 20} MiB")
        return _TensorReader(archive, members, name.removesuffix("data.pkl"), archive.read(name)).load()


class _Storage:
    """The kind of numbers of a storage, in place of the class of PyTorch."""

    def __init__(self, kind: str):
        self.kind = np.dtype(kind)


class _TensorReader(pickle.Unpickler):
    """Builds the tensors that a pickle describes as arrays. It knows no other functions, so that a file that names one
    is refused before anything is called."""

    def __init__(self, archive: zipfile.ZipFile, members: dict[str, zipfile.ZipInfo], home: str, data: bytes):
        super().__init__(io.BytesIO(data))
        self.archive, self.members, self.home = archive, members, home
        self.read: dict[str, np.ndarray] = {}

    def find_class(self, module: str, name: str) -> Any:
        if (module, name) == ("collections", "OrderedDict"):
            return OrderedDict
        if (module, name) == ("torch._utils", "_rebuild_tensor_v2"):
            return _rebuilt
        if (module, name) == ("torch._utils", "_rebuild_parameter"):
            return _parameter
        if module == "torch" and name in STORAGES:
            return _Storage(STORAGES[name])
        raise ValueError(f"it names {module}.{name}, which is no tensor, and is not executed; save tensors alone")

    def persistent_load(self, pid: Any) -> np.ndarray:
        word, storage, key, _, count = pid
        if word != "storage" or not isinstance(storage, _Storage) or not isinstance(key, str):
            raise ValueError("it refers to something that is no storage of numbers")
        if key not in self.read:
            member = self.members[f"{self.home}data/{key}"]
            if count != member.file_size // storage.kind.itemsize or count > MAX_NUMBERS:
                raise ValueError(f"a storage of {count} numbers has {member.file_size} bytes")
            self.read[key] = np.frombuffer(self.archive.read(member), storage.kind)
        return self.read[key]


def _rebuilt(storage: object, offset: int, size: tuple[int, ...], stride: tuple[int, ...], *_: object) -> np.ndarray:
    """A tensor as it lies in its storage, not beyond its end."""
    if not isinstance(storage, np.ndarray) or len(size) != len(stride) or min((offset, *size, *stride), default=0) < 0:
        raise ValueError("a tensor has no storage of numbers, or no such shape")
    last = offset + sum((n - 1) * step for n, step in zip(size, stride))
    count = math.prod(size)
    if count > MAX_NUMBERS or (count > 0 and last >= len(storage)):
        raise ValueError("a tensor reaches beyond its storage")
    if count == 0:
        return np.zeros(size)
    steps = [step * storage.itemsize for step in stride]
    return np.lib.stride_tricks.as_strided(storage[offset:], size, steps, writeable=False)


def _parameter(data: object, *_: object) -> object:
    return data


def _tensors(name: str, value: object) -> list[tuple[str, np.ndarray]]:
    if isinstance(value, np.ndarray):
        return [(name or "tensor", value)]
    if isinstance(value, dict):
        return [t for key, item in value.items() for t in _tensors(f"{name}.{key}" if name else str(key), item)]
    if isinstance(value, (list, tuple)) and value and all(isinstance(v, (int, float)) for v in value):
        return [(name, np.asarray(value, float))]
    if isinstance(value, (list, tuple)):
        return [t for k, item in enumerate(value) for t in _tensors(f"{name}[{k}]", item)]
    return []
