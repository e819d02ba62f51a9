"""The folder of one analysis (format kr5-sensitivity-run/1): analysis.json says what is evaluated, outputs.bin has a
record for every row of the sample matrices that is finished."""

import hashlib
import json
import zlib
from pathlib import Path

import kr5.uncertainty
import numpy as np
from kr5.files.writing import to_plain

from kr5_tools.sensitivity.analysis import Analysis, Row
from kr5_tools.sensitivity.model import Numbers
from kr5_tools.sweep.run_folder import Kind, RunFolder

RUN = Kind(
    what="sensitivity analysis",
    format="kr5-sensitivity-run/1",
    description="analysis.json",
    data="outputs.bin",
    options={
        "title": "arm, pose and group, or model",
        "inputs": "inputs (--inputs, --sigma-length, --sigma-angle, --truncation)",
        "outputs": "outputs",
        "seed": "--seed",
        "replicates": "--replicates",
        "model_sha256": "model",
        "version": "kr5",
    },
)


class OutputsFolder(RunFolder):
    """Outputs of rows that are finished. A record is the number of the row, a checksum, and the outputs as they come
    from the model; a record that is spoiled or broken off is evaluated again."""

    def __init__(self, path: Path, analysis: Analysis, outputs: int, options: kr5.uncertainty.SobolOptions):
        self.rows: dict[int, Numbers] = {}
        self.shape = (analysis.evaluations_of_row, outputs)
        self.record = np.dtype([("row", "<i8"), ("check", "<u4"), ("values", "<f8", self.shape)])
        model = json.dumps(to_plain(analysis.model.describe()), sort_keys=True)
        described = {
            "title": analysis.title,
            "inputs": [item.to_dict() for item in analysis.inputs],
            "outputs": outputs,
            "seed": options.seed,
            "replicates": options.replicates,
            "model_sha256": hashlib.sha256(model.encode()).hexdigest(),
        }
        super().__init__(path, RUN, described)

    def _read(self) -> None:
        self.file.seek(0)
        data = self.file.read()
        whole = len(data) // self.record.itemsize
        spoiled = int(whole * self.record.itemsize < len(data))
        if spoiled:  # was being written when the run was killed
            self.file.truncate(whole * self.record.itemsize)
        for record in np.frombuffer(data, self.record, whole):
            row, values = int(record["row"]), record["values"]
            if record["check"] == self._check(row, values) and row >= 0:
                self.rows[row] = values
            else:
                spoiled += 1
        if spoiled:
            rows = "1 row was" if spoiled == 1 else f"{spoiled} rows were"
            self.note = f"{self.path / RUN.data}: {rows} truncated or damaged; evaluated again"

    @staticmethod
    def _check(row: int, values: Numbers) -> int:
        return zlib.crc32(np.ascontiguousarray(values).tobytes(), row & 0xFFFFFFFF)

    def add(self, rows: list[Row]) -> None:
        """Keeps finished rows, come what may."""
        records = np.empty(len(rows), self.record)
        for record, (row, values) in zip(records, rows):
            record["row"], record["check"], record["values"] = row, self._check(row, values), values
        self._append(records.tobytes())
        self.rows |= dict(rows)

    def missing(self, samples: int) -> list[int]:
        return [row for row in range(samples) if row not in self.rows]

    def outputs(self, samples: int) -> Numbers:
        """The outputs of the first rows, in the order of the design."""
        return np.concatenate([self.rows[row] for row in range(samples)])
