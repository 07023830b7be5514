"""glTF 2.0 files, which nobody vouches for: `container` gets the bytes, `schema` says what JSON may hold, `validate` checks how it
hangs together, `accessors` decodes and decompresses, `load` makes a stage of it. Nothing outside the file's folder is read, and the limits
below hold."""

MAX_BYTES = 2**29  # of all files together, and of all decoded accessors together
MAX_ACCESSOR = 2**27  # bytes of one decoded accessor: what a shader may bind
MAX_JSON_VALUES = 2**22
MAX_PIXELS = 2**27  # of all images together
MAX_NODES = 20_000
MAX_DEPTH = 256
MAX_DRAWS = 4096  # primitives times the nodes that show them
MAX_VERTICES = 2**24  # of all that is drawn, and six times as many indices
MAX_INSTANCES = 2**17  # of EXT_mesh_gpu_instancing, each with an identifier of its own
MAX_INSTANCED = 2**27  # their vertices together
MAX_JOINTS = 1024  # of a skin: what a uniform buffer holds
MAX_TARGETS = 256  # morph targets of a primitive: layers of a texture
MAX_EXTENT = 1e9  # greatest coordinate in the world, and greatest number in the file
