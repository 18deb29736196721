"""One folder a drive: backend, codec, simulator; and what all drives share."""
