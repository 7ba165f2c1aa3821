"""Reads an MCAP file with the independent `mcap` package and says what is in it."""

import json
import sys

from mcap.reader import make_reader

counts, last, undescribed, frames = {}, {}, set(), b""
with open(sys.argv[1], "rb") as file:
    reader = make_reader(file)
    before = 0
    for schema, channel, message in reader.iter_messages(log_time_order=False):
        topic = channel.topic
        counts[topic] = counts.get(topic, 0) + 1
        if channel.message_encoding == "protobuf":
            # One field of bytes: its tag, its length in groups of seven bits, its bytes.
            length = 1
            while message.data[length] & 0x80:
                length += 1
            assert message.data[0] == 0x0A and schema.encoding == "protobuf"
            frames += message.data[length + 1 :]
            continue
        assert message.log_time >= before, f"{topic} goes back in time"
        before = message.log_time
        body = json.loads(message.data)
        described = json.loads(schema.data)
        assert schema.encoding == "jsonschema" and described["type"] == "object"
        for name in described.get("required", []):
            assert name in body, f"{topic} lacks {name}"
        undescribed |= {f"{topic} {name}" for name in body if name not in described["properties"]}
        last[topic] = body
    metadata = {record.name: record.metadata for record in reader.iter_metadata()}

print(
    json.dumps(
        {
            "counts": counts,
            "last": last,
            "undescribed": sorted(undescribed),
            "metadata": metadata,
            "frames": frames.hex(),
        }
    )
)
