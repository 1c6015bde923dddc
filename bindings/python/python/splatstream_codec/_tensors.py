"""What `torch.save` has written, without PyTorch and without running anything.

Such a file is a ZIP archive: `data.pkl` is a pickle of containers, in which a tensor is a call of one of few functions with a
storage, an offset, a shape and strides; the values of each storage are a member of the archive. The functions that are
known here keep these; nothing else is called.
"""

from __future__ import annotations

import os
import pickle
import zipfile
from collections import OrderedDict
from typing import Any

import numpy as np

from ._errors import SceneError

# Types of values, by the names of storages. bfloat16 is the upper half of float32.
_STORAGES = {
    "DoubleStorage": "f8",
    "FloatStorage": "f4",
    "HalfStorage": "f2",
    "BFloat16Storage": "bfloat16",
    "LongStorage": "i8",
    "IntStorage": "i4",
    "ShortStorage": "i2",
    "CharStorage": "i1",
    "ByteStorage": "u1",
    "BoolStorage": "?",
}


def load_tensors(path: str | os.PathLike[str]) -> Any:
    """What was saved: containers and numbers as they are, tensors to make arrays of, anything else as objects without content.

    Raises:
        SceneError: A file of another kind; one that is damaged.
    """
    name = os.fspath(path)
    try:
        with zipfile.ZipFile(name) as archive:
            return _read(archive, name)
    except zipfile.BadZipFile as error:
        raise SceneError(
            f"{name}: not a file of torch.save of PyTorch 1.6 or later: {error}", kind="malformed", path=name
        ) from error
    except (KeyError, EOFError, ValueError, TypeError, AttributeError, IndexError, pickle.UnpicklingError) as error:
        raise SceneError(f"{name}: cannot be read: {error}", kind="malformed", path=name) from error


def _read(archive: zipfile.ZipFile, name: str) -> Any:
    # Compressed members could be of any size; torch.save writes none.
    if any(member.compress_type != zipfile.ZIP_STORED for member in archive.infolist()):
        raise SceneError(f"{name}: this archive is compressed, and not one of torch.save", kind="malformed", path=name)
    members = archive.namelist()
    pickles = [member for member in members if member.endswith("/data.pkl")]
    if len(pickles) != 1:
        raise SceneError(f"{name}: this archive is not one of torch.save", kind="malformed", path=name)
    folder = pickles[0][: -len("data.pkl")]
    byteorder = folder + "byteorder"
    order = ">" if byteorder in members and archive.read(byteorder) == b"big" else "<"
    with archive.open(pickles[0]) as file:
        return _Unpickler(file, name, folder, order).load()


class _Storage:
    """Values that tensors share, in a member of the archive."""

    def __init__(self, path: str, member: str, code: str, order: str) -> None:
        self._path, self._member, self._code, self._order = path, member, code, order
        self.dtype = np.dtype(np.float32 if code == "bfloat16" else order + code)

    def wrong(self, what: str) -> SceneError:
        """What is wrong with the file."""
        return SceneError(f"{self._path}: {self._member}: {what}", kind="malformed", path=self._path)

    def read(self) -> np.ndarray[Any, np.dtype[Any]]:
        """All of them."""
        try:
            with zipfile.ZipFile(self._path) as archive:
                data = archive.read(self._member)
        except (KeyError, zipfile.BadZipFile) as error:
            raise self.wrong(str(error)) from error
        halves = self._code == "bfloat16"
        data = data[: len(data) - len(data) % (2 if halves else self.dtype.itemsize)]
        if not halves:
            return np.frombuffer(data, self.dtype)
        return (np.frombuffer(data, self._order + "u2").astype(np.uint32) << 16).view(np.float32)


class Tensor:
    """A tensor in a file, which NumPy makes an array of: only then its values are read."""

    def __init__(
        self, storage: _Storage | None, offset: int, size: tuple[int, ...], stride: tuple[int, ...], *_more: Any
    ) -> None:
        self._storage, self._offset, self._size, self._stride = storage, offset, size, stride

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> np.ndarray[Any, np.dtype[Any]]:
        if self._storage is None:
            raise ValueError("a tensor has values of a type that is not known")
        return self._values(self._storage).astype(dtype or self._storage.dtype)

    def _values(self, storage: _Storage) -> np.ndarray[Any, np.dtype[Any]]:
        """A view of the storage, which must hold it."""
        size, stride = self._size, self._stride
        if min(self._offset, *size, *stride, 0) < 0 or len(size) != len(stride):
            raise storage.wrong("a tensor has a negative size")
        if 0 in size:
            return np.empty(size, storage.dtype)
        values = storage.read()
        last = self._offset + sum((length - 1) * step for length, step in zip(size, stride))
        if last >= len(values):
            raise storage.wrong(f"a tensor needs {last + 1} values, its storage has {len(values)}")
        # Strides of 0 could make any number of values of one.
        if np.prod(size, dtype=np.float64) > len(values):
            raise storage.wrong("a tensor has more values than its storage")
        steps = [step * values.itemsize for step in stride]
        return np.lib.stride_tricks.as_strided(values[self._offset :], size, steps, writeable=False)


class _Kind:
    """The type of a storage, as pickles name it."""

    def __init__(self, code: str) -> None:
        self.code = code


class _Ignored:
    """An object that is not looked at, as of an optimiser or of a configuration."""

    def __init__(self, *_arguments: Any, **_names: Any) -> None:
        pass

    def __setstate__(self, _state: Any) -> None:
        pass

    def __call__(self, *_arguments: Any, **_names: Any) -> _Ignored:
        return self

    def append(self, _value: Any) -> None:
        """Some are lists."""

    def extend(self, _values: Any) -> None:
        """Some are lists."""

    def __setitem__(self, _name: Any, _value: Any) -> None:
        pass


def _parameter(tensor: Any, *_more: Any) -> Any:
    return tensor


# What a pickle of tensors calls.
_KNOWN: dict[tuple[str, str], Any] = {
    ("collections", "OrderedDict"): OrderedDict,
    ("torch._utils", "_rebuild_tensor_v2"): Tensor,
    ("torch._utils", "_rebuild_parameter"): _parameter,
}


class _Unpickler(pickle.Unpickler):
    def __init__(self, file: Any, path: str, folder: str, order: str) -> None:
        super().__init__(file)
        self._path, self._folder, self._order = path, folder, order

    def find_class(self, module: str, name: str) -> Any:
        """What stands for a name in the pickle: never what it names, but for the functions that are known."""
        if module in ("torch", "torch.storage") and name in _STORAGES:
            return _Kind(_STORAGES[name])
        return _KNOWN.get((module, name), _Ignored)

    def persistent_load(self, pid: Any) -> _Storage | None:
        """A storage: ("storage", type, number, device, count). One of a type that is not known is left out."""
        kind, number = pid[1], pid[2]
        known = isinstance(kind, _Kind)
        return _Storage(self._path, f"{self._folder}data/{number}", kind.code, self._order) if known else None
