"""Files of plain meshes, .obj, .ply and .stl, which nobody vouches for: `read` checks the bytes before trimesh parses them, `materials`
makes what an .mtl says, `load` makes a stage. Nothing outside the file's folder is read, and the limits of `gltf` hold."""

MAX_TEXT = 96 * 2**20  # bytes of a file that is text, which takes up to 20 times as much to parse
MAX_POLYGONS = 2**22  # faces with unlike numbers of corners, of a binary .ply
MAX_MASKED = 2**30  # vertices of an .obj times its parts: each part has a mask over all of them
