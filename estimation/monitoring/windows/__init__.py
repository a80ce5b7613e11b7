"""Windows: from rows of a stream to friction, offsets and payload, and the heat between them."""
