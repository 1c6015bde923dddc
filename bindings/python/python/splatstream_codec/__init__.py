"""SplatStream: scalable, dynamic 3D Gaussian splatting in one stream.

    import splatstream_codec as gss

    gss.encode(frames, "talk.gss", quality="high")         # arrays, files, or a generator of frames
    for frame in gss.decode("talk.gss", op="s0,t1,r2"):    # NumPy arrays: frame.position is (N, 3)
        print(frame.index, frame.time, frame.position.shape)

* `decode` iterates the frames of a file, of bytes or of a file object; `Decoder` also takes bytes as they arrive, seeks, and
  changes its operating point; `Slots` keeps each Gaussian at its row for renderers.
* `encode` writes a stream of frames; `Encoder` takes them as they come.
* `Gaussians` are a frame in memory: `Gaussians(position=..., ...)`, `Gaussians.load("scene.ply")`, or
  `from_checkpoint("ckpt.pt")` of gsplat, nerfstudio or the code of the original paper.
* `compare` and `inspect` give what the commands of these names print, as dictionaries. The command `splatstream` is installed
  with this package.

No stream panics or aborts: what is wrong is an exception with fields, see `StreamError`.
"""

from ._checkpoint import from_checkpoint, from_splats
from ._command import compare, inspect
from ._decode import decode
from ._encode import EncodeOptions, Encoder, EncodeResult, EncodeWarning, encode
from ._errors import CommandError, EncodeError, Error, IncompleteError, SceneError, StreamError
from ._native import VERSION as __version__
from ._native import Decoder, Frame, Gaussians, Limits, Slots, Update
from ._types import Damage, OperatingPoint

__all__ = [
    "CommandError",
    "Damage",
    "Decoder",
    "EncodeError",
    "EncodeOptions",
    "EncodeResult",
    "EncodeWarning",
    "Encoder",
    "Error",
    "Frame",
    "Gaussians",
    "IncompleteError",
    "Limits",
    "OperatingPoint",
    "SceneError",
    "Slots",
    "StreamError",
    "Update",
    "__version__",
    "compare",
    "decode",
    "encode",
    "from_checkpoint",
    "from_splats",
    "inspect",
]
