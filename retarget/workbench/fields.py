"""What the fields of messages may be: plain kinds with their bounds, which all desks share."""

from typing import Annotated

from msgspec import Meta

Number = Annotated[int, Meta(ge=0, le=10_000_000)]  # of a frame, a part, a joint: whatever is counted
Offset = Annotated[int, Meta(ge=0, le=2**40)]  # bytes of a file
Place = Annotated[float, Meta(ge=-1e5, le=1e5)]  # pixels
At = tuple[Place, Place]
Name = Annotated[str, Meta(min_length=1, max_length=60)]  # that a person gives
Known = Annotated[str, Meta(min_length=1, max_length=200)]  # that a document gives: of a part, a key, who plays
File = Annotated[str, Meta(min_length=1, max_length=400)]  # in the folder
Piece = Annotated[bytes, Meta(max_length=2**19)]  # of a file
