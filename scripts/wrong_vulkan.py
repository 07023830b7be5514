"""Uses Vulkan wrongly, twice: a buffer of no size, and two writes of one buffer with nothing between. A validation layer that is there,
and looks at synchronisation too, says so of both."""

from cffi import FFI

DECLARATIONS = """
typedef struct T *Handle; typedef uint64_t Object;
typedef struct { int s; const void *n; uint32_t flags; const void *app; uint32_t layers; const char *const *layer; uint32_t extensions;
  const char *const *extension; } InstanceInfo;
typedef struct { int s; const void *n; uint32_t flags, family, count; const float *priorities; } QueueInfo;
typedef struct { int s; const void *n; uint32_t flags, queues; const QueueInfo *queue; uint32_t layers; const char *const *layer;
  uint32_t extensions; const char *const *extension; const void *features; } DeviceInfo;
typedef struct { int s; const void *n; uint32_t flags; uint64_t size; uint32_t usage; int sharing; uint32_t families;
  const uint32_t *family; } BufferInfo;
typedef struct { uint64_t size, alignment; uint32_t types; } Requirements;
typedef struct { int s; const void *n; uint64_t size; uint32_t type; } MemoryInfo;
typedef struct { int s; const void *n; uint32_t flags, family; } PoolInfo;
typedef struct { int s; const void *n; Object pool; int level; uint32_t count; } CommandsInfo;
typedef struct { int s; const void *n; uint32_t flags; const void *inherited; } BeginInfo;
int vkCreateInstance(const InstanceInfo *, const void *, Handle *);
int vkEnumeratePhysicalDevices(Handle, uint32_t *, Handle *);
int vkCreateDevice(Handle, const DeviceInfo *, const void *, Handle *);
int vkCreateBuffer(Handle, const BufferInfo *, const void *, Object *);
void vkGetBufferMemoryRequirements(Handle, Object, Requirements *);
int vkAllocateMemory(Handle, const MemoryInfo *, const void *, Object *);
int vkBindBufferMemory(Handle, Object, Object, uint64_t);
int vkCreateCommandPool(Handle, const PoolInfo *, const void *, Object *);
int vkAllocateCommandBuffers(Handle, const CommandsInfo *, Handle *);
int vkBeginCommandBuffer(Handle, const BeginInfo *);
void vkCmdFillBuffer(Handle, Object, uint64_t, uint64_t, uint32_t);
int vkEndCommandBuffer(Handle);
"""
INSTANCE, QUEUE, DEVICE, MEMORY, BUFFER, POOL, COMMANDS, BEGIN = 1, 2, 3, 5, 12, 39, 40, 42  # VkStructureType
TRANSFER_DST = 2
SIZE = 256


def main() -> None:
    ffi = FFI()
    ffi.cdef(DECLARATIONS)
    vk = ffi.dlopen("libvulkan.so.1")

    def made(create: str, kind: str, *given: object) -> object:
        out = ffi.new(f"{kind} *")
        code = getattr(vk, create)(*given, ffi.NULL, out)
        if code:
            raise SystemExit(f"{create}: {code}")
        return out[0]

    instance = made("vkCreateInstance", "Handle", ffi.new("InstanceInfo *", {"s": INSTANCE}))
    count, physical = ffi.new("uint32_t *", 1), ffi.new("Handle *")
    vk.vkEnumeratePhysicalDevices(instance, count, physical)  # the first, of however many
    queue = ffi.new("QueueInfo *", {"s": QUEUE, "count": 1, "priorities": (priority := ffi.new("float *", 1.0))})
    device = made("vkCreateDevice", "Handle", physical[0], ffi.new("DeviceInfo *", {"s": DEVICE, "queues": 1, "queue": queue}))
    assert priority[0] == 1  # and lives until here

    made("vkCreateBuffer", "Object", device, ffi.new("BufferInfo *", {"s": BUFFER, "usage": TRANSFER_DST}))  # of no size
    buffer = made("vkCreateBuffer", "Object", device, ffi.new("BufferInfo *", {"s": BUFFER, "size": SIZE, "usage": TRANSFER_DST}))
    needs = ffi.new("Requirements *")
    vk.vkGetBufferMemoryRequirements(device, buffer, needs)
    kind = (needs.types & -needs.types).bit_length() - 1
    memory = made("vkAllocateMemory", "Object", device, ffi.new("MemoryInfo *", {"s": MEMORY, "size": needs.size, "type": kind}))
    vk.vkBindBufferMemory(device, buffer, memory, 0)
    pool = made("vkCreateCommandPool", "Object", device, ffi.new("PoolInfo *", {"s": POOL}))
    commands = ffi.new("Handle *")
    vk.vkAllocateCommandBuffers(device, ffi.new("CommandsInfo *", {"s": COMMANDS, "pool": pool, "count": 1}), commands)
    vk.vkBeginCommandBuffer(commands[0], ffi.new("BeginInfo *", {"s": BEGIN}))
    for value in (1, 2):  # no barrier between: which of the two stays is left open
        vk.vkCmdFillBuffer(commands[0], buffer, 0, SIZE, value)
    vk.vkEndCommandBuffer(commands[0])


if __name__ == "__main__":
    main()
