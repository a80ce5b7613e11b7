from estimation.recordings.recording import Recording as Recording
from estimation.recordings.recording import make_ready as make_ready
