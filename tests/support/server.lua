--- server.lua: a listening socket of this process on 127.0.0.1. The kernel accepts connections,
--- which wait until `answer` is called: without it, the server never answers.

local bit = require "bit"
local ffi = require "ffi"

local server = {}

-- each suite file loads this again, but a struct may be declared only once in a process
if not pcall(ffi.typeof, "struct limax_test_address") then ffi.cdef [[
struct limax_test_address { uint16_t family; uint16_t port; uint32_t address; uint8_t zero[8]; };
struct limax_test_time { long seconds; long microseconds; };
int socket(int domain, int type, int protocol);
int bind(int descriptor, const struct limax_test_address* address, uint32_t length);
int listen(int descriptor, int backlog);
int accept(int descriptor, void* address, uint32_t* length);
int getsockname(int descriptor, struct limax_test_address* address, uint32_t* length);
int setsockopt(int descriptor, int level, int name, const void* value, uint32_t length);
ssize_t recv(int descriptor, void* buffer, size_t length, int flags);
ssize_t send(int descriptor, const void* buffer, size_t length, int flags);
int close(int descriptor);
]] end

-- Linux
local AF_INET, SOCK_STREAM, SOCK_CLOEXEC = 2, 1, 0x80000
local SOL_SOCKET, SO_RCVTIMEO, MSG_NOSIGNAL = 1, 20, 0x4000
local LOOPBACK = { 127, 0, 0, 1 }
local PATIENCE = 120 -- s

-- a 16-bit number with swapped bytes: ports are big-endian
local function swap(port) return bit.rshift(bit.bswap(port), 16) end

local function patient(descriptor)
  local time = ffi.new("struct limax_test_time", PATIENCE, 0)
  ffi.C.setsockopt(descriptor, SOL_SOCKET, SO_RCVTIMEO, time, ffi.sizeof(time))
end

local methods = {}
local class = { __index = methods }

---@return table server with .port and .url
function server.open()
  local descriptor = ffi.C.socket(AF_INET, bit.bor(SOCK_STREAM, SOCK_CLOEXEC), 0)
  local address = ffi.new "struct limax_test_address"
  address.family = AF_INET
  ffi.copy(ffi.cast("uint8_t*", address) + 4, string.char(unpack(LOOPBACK)), 4)
  local size = ffi.sizeof(address)
  assert(descriptor >= 0 and ffi.C.bind(descriptor, address, size) == 0
    and ffi.C.listen(descriptor, 8) == 0, "cannot open a loopback socket")
  ffi.C.getsockname(descriptor, address, ffi.new("uint32_t[1]", size))
  patient(descriptor)
  local port = swap(address.port)
  return setmetatable({ descriptor = descriptor, port = port,
    url = ("http://127.0.0.1:%d/"):format(port) }, class)
end

--- Accepts one request and answers with these bytes.
---@param bytes string a complete HTTP response
---@return string request at least up to the end of its headers
function methods:answer(bytes)
  local peer = ffi.C.accept(self.descriptor, nil, nil)
  assert(peer >= 0, "no connection")
  patient(peer)
  local buffer, request = ffi.new "char[65536]", ""
  while not request:find("\r\n\r\n", 1, true) do
    local count = tonumber(ffi.C.recv(peer, buffer, 65536, 0))
    if count <= 0 then break end
    request = request .. ffi.string(buffer, count)
  end
  local sent = 0
  while sent < #bytes do
    local rest = bytes:sub(sent + 1)
    local count = tonumber(ffi.C.send(peer, rest, #rest, MSG_NOSIGNAL))
    if count <= 0 then break end
    sent = sent + count
  end
  ffi.C.close(peer)
  return request
end

function methods:close() ffi.C.close(self.descriptor) end

return server
