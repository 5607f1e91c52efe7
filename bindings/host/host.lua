---@meta limax.host
--- host.lua: what the module `limax.host` holds, for editors. Its bodies are the C++ files beside
--- it; this file is never run.

---@class limax.host.json
---@field null userdata stands for null
---@field encode fun(value: any, options?: { indent?: integer }): string keys sorted; raises on NaN
---@field decode fun(text: string, origin?: string): any, string|nil nil and a message
---@field array fun(list: table): table marks it, so that it is written as [] when it is empty
---@field is_array fun(value: any): boolean

---@class limax.host.lock
---@field free fun(self: limax.host.lock)

-- Files that a thread of its own writes, one after the other, until one fails. Jobs count from 1.
---@class limax.host.writer
---@field write fun(self: limax.host.writer, path: string, text: string, array?: ffi.cdata*,
--- bytes?: integer): integer a job: whole or not at all, the array after the text
---@field append fun(self: limax.host.writer, path: string, text: string): integer whole lines
---@field wait fun(self: limax.host.writer, job?: integer): true|nil, string|nil until it and all
--- before it, or all, are on disk
---@field done fun(self: limax.host.writer): integer the last job that is on disk

-- Each answers true (or its value), or nil and a message that names the path.
---@class limax.host.file
---@field write_atomic fun(path: string, text: string): true|nil, string|nil whole or not at all
---@field append fun(path: string, text: string, private?: boolean): true|nil, string|nil whole
--- lines, on disk then; a file that it makes is, if private, its owner's alone
---@field mkdir fun(path: string): true|nil, string|nil with the folders above it
---@field exists fun(path: string): "file"|"folder"|nil
---@field list fun(path: string): string[]|nil, string|nil sorted names
---@field read_private fun(path: string): string|nil, string|nil only its owner, us, may touch it
---@field truncate fun(path: string, size: integer): true|nil, string|nil
---@field remove fun(path: string): true|nil, string|nil a file or an empty folder
---@field rename fun(from: string, to: string): true|nil, string|nil
---@field absolute fun(path: string): string
---@field lock fun(path: string): limax.host.lock|nil, string|nil a file or folder, for one process
---@field writer fun(): limax.host.writer

---@class limax.host.signal
---@field acknowledge fun() ends an interrupt by hand; a second Ctrl-C ends the process at once
---@field rearm fun() the next Ctrl-C counts as a first one: for prompts
---@field on_hard_stop fun(line: string|nil) what standard error gets if the process must end
--- without Lua: after 2 s without an answer, or by a second Ctrl-C; nil: nothing any more

---@class limax.host.request
---@field url string https, or http to this machine
---@field method? string GET, or POST with a body
---@field headers? table<string, string>
---@field body? string
---@field timeout? number s for the whole exchange, 60
---@field connect_timeout? number s until the connection stands, 30
---@field largest? integer bytes of an answer's body, unpacked; 16777216 (16 MiB)
---@field ca_file? string PEM certificates to trust instead of the system's
---@field allow_insecure? boolean plain http to other machines too

---@class limax.host.answer
---@field status integer
---@field headers table<string, string> names in lower case
---@field body string

-- What had come when a request failed; status is 0 where no answer had begun.
---@class limax.host.http_problem: limax.host.answer
---@field kind "url"|"resolve"|"connect"|"connect_timeout"|"tls"|"certificate"|"timeout"|"reset"|
---"partial"|"size"|"headers"|"encoding"|"protocol"
---@field curl string libcurl's own words

---@class limax.host.url
---@field scheme string
---@field host string an IPv6 address in brackets
---@field port? string
---@field path string
---@field query? string
---@field fragment? string
---@field loopback boolean does it mean this machine?
---@field credentials boolean a user or a password stands in it

-- Its children are its list.
---@class limax.host.element
---@field name string
---@field text string its own, CDATA included
---@field attributes table<string, string>

-- Entries are { name, bytes }. At most 1000 entries and 256 MiB are unpacked, in memory; a name
-- that leaves the archive is refused.
---@class limax.host.zip
---@field pack fun(entries: string[][]): string the same bytes at any time
---@field unpack fun(archive: string): string[][]|nil, string|nil

---@class limax.host.sandboxed
---@field source string Lua text that returns a function(text, limits)
---@field name string of the source, "=parse.lua"
---@field text string
---@field limits string JSON
---@field seconds? number 5 at most, the default
---@field bytes? number 64 MiB at most, the default

-- Pixels are texts of four bytes each (red, green, blue, opacity), rows from the top.
---@class limax.host.image
---@field png fun(width: integer, height: integer, pixels: string, dpi?: number): string the file
---@field gif fun(width: integer, height: integer, frames: string[], hundredths: integer): string
--- an animation that repeats, each frame shown for so many hundredths of a second

---@class limax.host.terminal
---@field stdin boolean
---@field stdout boolean
---@field stderr boolean
---@field columns integer
---@field color boolean on the standard output
---@field color_stderr boolean

---@class limax.host.line_editor
---@field read fun(prompt: string, complete: fun(before: string): (string|nil, string|nil),
---idle: fun(): boolean): string|nil a line, nil at the end; `complete` is given what stands before
--- the cursor and returns what to insert, and what to show; `idle` is called every half second
--- without a key, and returns whether it wrote anything
---@field remember fun(text: string) adds to the history of this process

---@class limax.host.environment
---@field compiler string
---@field build string
---@field cpu string
---@field cores integer that this process may use
---@field hostname string
---@field system string
---@field luajit string
---@field cuda string|nil version of the driver
---@field cuda_compiler string|nil the nvcc that was there when limax was configured

---@class limax.host
---@field home string the data folder, which holds scripts/, prompts/ and materials/
---@field executable string
---@field version string
---@field cdef string the declarations of limax.h
---@field json limax.host.json
---@field file limax.host.file
---@field signal limax.host.signal
---@field interrupt table the error value that Ctrl-C raises
---@field interrupted fun(): boolean
---@field raise_if_interrupted fun()
---@field protect fun(call: function, ...): boolean, any, any pcall that also ends an interrupt
---@field within fun(seconds: number, handler: function, call: function, ...): boolean, any xpcall
--- of a function without the compiler, stopped after so many seconds
---@field sandbox fun(request: limax.host.sandboxed): boolean, any, string|nil, string|nil runs a
--- parser in a Lua state of its own: true, what it returned (the second and third are texts), or
--- false and why
---@field exit fun(status?: integer) with output flushed and objects freed
---@field image limax.host.image
---@field deflate fun(bytes: string): string a zlib stream
---@field sha256 fun(text: string): string hexadecimal
---@field http fun(request: limax.host.request): limax.host.answer|nil, string|nil,
---limax.host.http_problem|nil
---@field url fun(text: string): limax.host.url|nil, string|nil as libcurl reads it
---@field zip limax.host.zip
---@field xml fun(text: string, origin?: string): limax.host.element|nil, string|nil the root; a
--- document type is refused, entities other than XML's own are not expanded
---@field clock fun(): number s, never steps back
---@field wait fun(seconds: number) Ctrl-C ends it at once
---@field time fun(): string "2026-11-21T10:15:03Z"
---@field terminal fun(): limax.host.terminal
---@field line_editor limax.host.line_editor|nil nil where limax was built without libedit
---@field environment fun(): limax.host.environment
---@field opens fun(library: string): true|nil, string|nil can this shared library be loaded?
local host = {}

return host
