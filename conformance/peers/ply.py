"""Gaussians, and the standard PLY they are exchanged in: binary little endian floats in the original order."""

from dataclasses import dataclass

import numpy as np

GROUPS = {"position": ["x", "y", "z"], "colour": ["f_dc_0", "f_dc_1", "f_dc_2"], "sh": [], "opacity": ["opacity"],
          "scale": ["scale_0", "scale_1", "scale_2"], "rotation": ["rot_0", "rot_1", "rot_2", "rot_3"]}
SCALARS = {"char": "i1", "uchar": "u1", "short": "<i2", "ushort": "<u2", "int": "<i4", "uint": "<u4", "float": "<f4",
           "double": "<f8", "int8": "i1", "uint8": "u1", "int16": "<i2", "uint16": "<u2", "int32": "<i4",
           "uint32": "<u4", "float32": "<f4", "float64": "<f8"}
CERTAIN = np.float32(13.815510)  # the logit of 1 - 1e-6, written for an opacity of exactly 0 or 1
DEGREES = {0: 0, 9: 1, 24: 2, 45: 3}


@dataclass
class Gaussians:
    """Float32 rows in PLY's domain and axes (x right, y down, z forward)."""

    position: np.ndarray
    colour: np.ndarray    # f_dc: the coefficient, not the colour
    sh: np.ndarray        # f_rest: one channel after another, 0, 9, 24 or 45 columns
    opacity: np.ndarray   # before the sigmoid, one column
    scale: np.ndarray     # natural log
    rotation: np.ndarray  # w x y z, unit length

    def __len__(self):
        return len(self.position)

    @property
    def degree(self):
        return DEGREES[self.sh.shape[1]]

    def coefficients(self):
        """sh as [Gaussian, coefficient, channel]."""
        return self.sh.reshape(len(self), 3, -1).transpose(0, 2, 1)


def from_coefficients(coefficients):
    return coefficients.transpose(0, 2, 1).reshape(len(coefficients), -1)


def read(path):
    with open(path, "rb") as file:
        return parse(file.read())


def parse(data):
    end = data.index(b"end_header\n") + len(b"end_header\n")
    lines = [line.split() for line in data[:end].decode("latin-1").splitlines()]
    if ["format", "binary_little_endian", "1.0"] not in lines:
        raise ValueError("only binary little endian PLY is read")
    element = next(i for i, line in enumerate(lines) if line[:1] == ["element"])
    if lines[element][1] != "vertex":
        raise ValueError("the first element of the PLY is not vertex")
    fields = []
    for line in lines[element + 1:]:
        if line[:1] == ["element"]:
            break
        if line[:1] == ["property"]:
            fields.append((line[2], SCALARS[line[1]]))
    rows = np.frombuffer(data, np.dtype(fields), int(lines[element][2]), end)
    groups = dict(GROUPS, sh=["f_rest_%d" % k for k in range(sum(n.startswith("f_rest_") for n, _ in fields))])
    columns = {group: _columns(rows, names) for group, names in groups.items()}
    length = np.linalg.norm(columns["rotation"], axis=1, keepdims=True)
    columns["rotation"] = columns["rotation"] / np.where(length == 0, 1, length)
    return Gaussians(**columns)


def write(path, gaussians):
    names, columns = [], []
    for group in GROUPS:
        column = getattr(gaussians, group)
        if group == "opacity":
            column = np.nan_to_num(column, nan=np.nan, posinf=CERTAIN, neginf=-CERTAIN)
        names += GROUPS[group] or ["f_rest_%d" % k for k in range(column.shape[1])]
        columns.append(column)
    table = np.ascontiguousarray(np.concatenate(columns, axis=1), "<f4")
    header = ["ply", "format binary_little_endian 1.0", "element vertex %d" % len(table)]
    header += ["property float " + name for name in names] + ["end_header", ""]
    with open(path, "wb") as file:
        file.write("\n".join(header).encode())
        file.write(table.tobytes())


def is_standard(path):
    """Whether the file is a PLY that `read` takes: not the packed kind, nor another format."""
    with open(path, "rb") as file:
        header = file.read(4096).split(b"end_header")[0]
    return header.startswith(b"ply") and b"packed_position" not in header and b"little_endian" in header


def _columns(rows, names):
    return np.stack([rows[name] for name in names], 1).astype("<f4") if names else np.zeros((len(rows), 0), "<f4")
