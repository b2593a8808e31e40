import cv2
import torch

# The networks of the tests are tiny: more threads only wait for one another.
torch.set_num_threads(1)
cv2.setNumThreads(1)
