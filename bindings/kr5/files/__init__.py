"""Files of kr5 and of others, read and written: results, cameras, images, YAML and JSON.

`read_result` reads what a command wrote with -o, `load_camera` a camera of kr5, ROS, OpenCV or ViSP, `read_document` a
YAML or JSON file against a model of pydantic. What is wrong with a file is raised as kr5.FileError: file, line, field,
problem and remedy. Files are written beside and renamed (`beside`, `write_text`, `write_json`); those that are written
inside `held_back` appear together or not at all.
"""

from kr5.files.camera import load_camera
from kr5.files.documents import Document, read_document, read_json, read_text, read_yaml
from kr5.files.images import image_files
from kr5.files.results import read_result, write_result
from kr5.files.writing import beside, folder_beside, held_back, write_json, write_text

__all__ = [
    "Document",
    "beside",
    "folder_beside",
    "held_back",
    "image_files",
    "load_camera",
    "read_document",
    "read_json",
    "read_result",
    "read_text",
    "read_yaml",
    "write_json",
    "write_result",
    "write_text",
]
