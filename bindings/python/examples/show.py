"""Shows frames of a stream side by side: centres of Gaussians in their colours, seen from the front.

    python show.py talk.gss [pictures.png]
"""

import sys

import matplotlib.pyplot as plt
import numpy as np

import splatstream_codec as gss

# The lowest layers with all refinements.
frames = list(gss.decode(sys.argv[1], op="s0,t0,r255"))
figure, axes = plt.subplots(1, len(frames), figsize=(3 * len(frames), 3), squeeze=False, sharex=True, sharey=True)
for axis, frame in zip(axes[0], frames):
    # Far ones first; y points down, as in pictures.
    order = np.argsort(-frame.position[:, 2])
    x, y = frame.position[order, 0], frame.position[order, 1]
    colour = np.clip(0.5 + 0.2821 * frame.dc[order], 0, 1)
    alpha = 1 / (1 + np.exp(-frame.opacity_logit[order]))
    size = 400 * np.exp(frame.log_scale[order]).mean(axis=1)
    axis.scatter(x, y, s=size, c=np.column_stack([colour, alpha]), edgecolors="none")
    axis.set(title=f"{frame.time:.2f} s: {len(frame)}", aspect="equal", xticks=[], yticks=[])
axes[0][0].invert_yaxis()
figure.tight_layout()
if len(sys.argv) > 2:
    figure.savefig(sys.argv[2], dpi=100)
else:
    plt.show()
