"""NPZ logs: arrays of numbers, read into columns by name."""

import io
import math
import zipfile
from pathlib import Path

import numpy as np

import kr5
from kr5.logs.log import Log

MAX_COLUMNS = 20_000
MAX_ARRAY_BYTES = 2 << 30  # of an array
MOST_JOINTS = 99  # of an arm; an array with more columns has instants in them


def read_npz(file: Path) -> Log:
    """Arrays by name; `q` of n x 6, or of 6 x n, becomes `q[0]` ... `q[5]`. Arrays of one length are one stream."""
    log = Log(file)
    try:
        arrays = _load_arrays(file)
    except (
        Exception
    ) as error:  # what zip, its decompressors and the parser of headers raise at damaged bytes is no closed list
        why = str(error).split("\n")[0][:200] or type(error).__name__
        raise kr5.FileError(
            file, f"cannot be read as NPZ: {why}; expected arrays of numbers saved with numpy.savez"
        ) from error
    log.notes = _turn_arrays(arrays, file)
    for name, values in arrays.items():
        flat = values.reshape(len(values), math.prod(values.shape[1:]))
        if len(log.columns) + flat.shape[1] > MAX_COLUMNS:
            raise kr5.FileError(
                file, f"found {flat.shape[1]} columns, expected at most {MAX_COLUMNS} in a log", field=name
            )
        for k in range(flat.shape[1]):
            log.add(name if values.ndim == 1 else f"{name}[{k}]", flat[:, k], f"{len(values)} rows")
    if not log.columns:
        raise kr5.FileError(file, "contains no array of numbers")
    log.join_stamps()
    return log


def _turn_arrays(arrays: dict[str, np.ndarray], file: Path) -> list[str]:
    """Turns the arrays that have joints in rows and instants in columns, as the vectors of the file tell, such as the
    time; without vectors those of more columns than an arm has joints. Says so in words."""
    lengths = {len(values): name for name, values in arrays.items() if len(values) == values.size}
    turned: dict[str, list[str]] = {}  # by their shape
    for name, values in arrays.items():
        if values.ndim != 2 or len(values) >= min(values.shape[1], MOST_JOINTS + 1):
            continue
        rows, columns = values.shape
        fits = columns in lengths or not lengths
        if columns > MOST_JOINTS and not fits and rows not in lengths:
            vectors = ", ".join(f"{vector} has {length}" for length, vector in lengths.items())
            raise kr5.FileError(
                file,
                f"{name}: found {rows} x {columns} values, expected as many rows, or columns, as a vector of"
                f" the file has values, such as the time ({vectors})",
            )
        if fits and (columns > MOST_JOINTS or (lengths and rows not in lengths)):
            arrays[name] = values.T
            turned.setdefault(f"{rows} x {columns}", []).append(name)
    return [
        f"{', '.join(names)} of {file.name} {'has' if len(names) == 1 else 'have'} a row for each joint ({shape}) and"
        f" {'was' if len(names) == 1 else 'were'} turned, so that each row is an instant"
        for shape, names in turned.items()
    ]


def _load_arrays(file: Path) -> dict[str, np.ndarray]:
    """The arrays of numbers with rows. What an array says of its size is not believed before it is seen that the
    file holds so much.
    """
    out = {}
    with zipfile.ZipFile(file) as archive:
        for member in archive.infolist():
            if not member.filename.endswith(".npy"):
                continue
            if member.file_size > MAX_ARRAY_BYTES:
                raise ValueError(f"{member.filename} is larger than {MAX_ARRAY_BYTES >> 20} MiB")
            data = archive.read(member)
            values = parse_npy(data, member.filename)
            if values.ndim and len(values) and values.dtype.kind in "fiub":
                out[member.filename.removesuffix(".npy")] = values
    return out


def parse_npy(data: bytes, name: str) -> np.ndarray:
    """The array of an NPY file, without pickles, unless its header tells of more than there is. Damaged bytes raise
    exceptions of any kind."""
    stream = io.BytesIO(data)
    read_header = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}
    version = np.lib.format.read_magic(stream)
    if version not in read_header:
        raise ValueError(f"{name} is of version {version[0]}.{version[1]}, expected 1.0 or 2.0")
    shape, _, dtype = read_header[version](stream)
    if math.prod(shape) * dtype.itemsize > len(data):
        raise ValueError(f"{name} tells of {shape} values, more than it holds")
    stream.seek(0)
    return np.asarray(np.lib.format.read_array(stream, allow_pickle=False))
