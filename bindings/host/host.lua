---@meta limax.host
--- host.lua: the module `limax.host`, for editors. The C++ files beside it and start.lua implement
--- it; this file is never run.

---@class limax.host.json
---@field null userdata the value of null
---@field encode fun(value: any, options?: { indent?: integer }): string keys sorted; raises on NaN
---@field decode fun(text: string, origin?: string): any, string|nil nil and a message
---@field array fun(list: table): table marks a table, so that it is written as [] if it is empty
---@field is_array fun(value: any): boolean

-- Writes files asynchronously and in order, until one fails: a job that is done implies all before
-- it. Jobs count from 1. `write`, `write_array` and `append` return the number of the job, and size
-- and XXH3 of its bytes; of an array, which is hashed asynchronously, a placeholder of the hash.
---@class limax.host.writer
---@field write fun(self, path: string, text: string): integer, integer, string
---@field array fun(self, bytes: integer): lightuserdata to fill, and then to write
---@field write_array fun(self, path: string): integer, integer, string
---@field append fun(self, path: string, text: string): integer, integer, string not through a link
---@field append_sealed fun(self, path: string, line: string, bytes: integer): integer a line of
--- base/sealed.lua; placeholders in its first bytes are replaced
---@field hash fun(self, job: integer): string of an array on disk, once
---@field expect fun(self, path: string, bytes: integer): integer fails unless a file has this size
---@field remove fun(self, path: string): integer a file, which may be missing
---@field wait fun(self, job?: integer): true|nil, string|nil until jobs up to this one, or all, are
--- on disk
---@field done fun(self): integer number of jobs on disk

---@alias limax.host.lock { free: fun(self) }

-- Each returns true (or its value), or nil and a message with the path.
---@class limax.host.file
---@field write_atomic fun(path: string, text: string): true|nil, string|nil complete or not at all
---@field append fun(path: string, text: string, private?: boolean): true|nil, string|nil whole
--- lines, on disk when it returns; if private, only the owner can access a file that it creates
---@field mkdir fun(path: string): true|nil, string|nil and the folders above it
---@field exists fun(path: string, of_link?: boolean): "file"|"folder"|"other"|nil a link counts as
--- what it refers to, or with `of_link` as "other", like pipes and devices
---@field list fun(path: string): string[]|nil, string|nil sorted names
---@field create_private fun(path: string, text: string): boolean|nil, string|nil a new file that
--- only this user can access, complete or not at all; false where the name exists
---@field read_private fun(path: string): string|nil, string|nil if only this user can access it
---@field truncate fun(path: string, size: integer): true|nil, string|nil
---@field remove fun(path: string): true|nil, string|nil a file or an empty folder
---@field rename fun(from: string, to: string): true|nil, string|nil
---@field absolute fun(path: string): string
---@field lock fun(path: string): limax.host.lock|nil, string|nil, "locked"|nil locks a regular
--- file, created if missing, until it is freed or this process ends; "locked": another one has it
---@field is_locked fun(path: string): boolean|nil, string|nil needs only the right to read it
---@field temporary fun(): string|nil, string|nil path of a new folder in $TMPDIR, else in /tmp,
--- that only this user can access; the process removes it at its end, unless it is killed
---@field remove_temporary fun(path: string): true|nil, string|nil with everything in it
---@field writer fun(): limax.host.writer

---@class limax.host.signal
---@field rearm fun(): boolean the next Ctrl-C counts as the first one, for prompts; false after
--- SIGTERM, which ends them
---@field status fun(): integer exit status of an interrupt: 130 after Ctrl-C, 143 after SIGTERM
---@field on_hard_stop fun(line: string|nil) a line for standard error if the process ends without
--- Lua: 2 s after Ctrl-C without a reaction, or by a second Ctrl-C; nil: none
---@field watch fun(name: string|nil): string|nil names the user's function that runs, for a report
--- after 5 s and at Ctrl-C; nil: none runs; returns the name before

---@class limax.host.request
---@field url string https, or http to this machine
---@field headers? table<string, string>
---@field body? string of a POST; a GET without it
---@field timeout? number s for the whole exchange, 60
---@field connect_timeout? number s until the connection is established, 30
---@field largest? integer bytes of an answer's body, unpacked; 16777216 (16 MiB)
---@field ca_file? string PEM certificates to trust instead of the system's
---@field allow_insecure? boolean plain http to other machines as well

---@class limax.host.answer
---@field status integer 0 if a request failed and no answer began
---@field headers table<string, string> names in lower case
---@field body string what came
---@field kind "url"|"resolve"|"connect"|"connect_timeout"|"tls"|"certificate"|"timeout"|"reset"|
---"partial"|"size"|"headers"|"encoding"|"protocol"|nil of a failure
---@field curl string|nil libcurl's message about it

-- As libcurl reads it; an IPv6 address is in brackets. `loopback`: is the host this machine?
-- `credentials`: does it contain a user or a password?
---@alias limax.host.url { scheme: string, host: string, port?: string, path: string,
---query?: string, fragment?: string, loopback: boolean, credentials: boolean }

-- The list part has its children; its own text includes CDATA.
---@alias limax.host.element { name: string, text: string, attributes: table<string, string> }

---@class limax.host.line_editor
---@field read fun(prompt: string, complete: fun(before: string): (string|nil, string|nil)):
--- string|nil a line, nil at the end; `complete` gets the text before the cursor and returns a text
--- to insert and one to show
---@field remember fun(text: string) adds to the history

---@class limax.host
---@field home string the data folder, with scripts/, prompts/ and materials/
---@field executable string
---@field version string
---@field commit string|nil
---@field cdef string the declarations of limax.h
---@field cores integer that this process may use
---@field json limax.host.json
---@field file limax.host.file
---@field signal limax.host.signal
---@field interrupt table the error value that Ctrl-C raises
---@field raise_if_interrupted fun()
---@field protect fun(call: function, ...): boolean, any, any a pcall that also catches Ctrl-C
---@field within fun(seconds: number, handler: function, call: function, ...): boolean, any an
--- xpcall without the compiler that is stopped after so many seconds
---@field sandbox fun(request: { source: string, name: string, text: string, limits: table },
---seconds?: number): boolean, any, string|nil, string|nil runs a parser, Lua text that returns a
--- function(text, limits), in a child process: true and what it returned (the second and third are
--- texts), or false and why. 5 s are the most and the default
---@field exit fun(status?: integer) flushes output and frees objects
---@field image { gif: fun(width: integer, height: integer, frames: string[],
---hundredths: integer): string } an animation that repeats, each frame shown for so many hundredths
--- of a second; pixels are four bytes each (red, green, blue, opacity), rows from the top
---@field deflate fun(bytes: string): string a zlib stream
---@field sha256 fun(text: string): string hexadecimal
---@field hmac_sha256 fun(key: string, text: string): string hexadecimal
---@field xxh3 fun(text: string): string 64 bits, hexadecimal
---@field http fun(request: limax.host.request): limax.host.answer|nil, string|nil,
---limax.host.answer|nil nil, a message and what came before it failed
---@field url fun(text: string): limax.host.url|nil, string|nil
---@field zip { pack: fun(entries: string[][]): string, unpack: fun(archive: string): string[][] }
--- entries are { name, bytes }; equal ones give equal bytes. At most 1000 entries and 256 MiB are
--- unpacked, in memory; names of places outside of the archive are refused (nil and a message)
---@field xml fun(text: string, origin?: string): limax.host.element|nil, string|nil the root; a
--- document type is refused, only XML's own entities are expanded
---@field clock fun(): number s, monotonic
---@field wait fun(seconds: number) Ctrl-C ends it at once
---@field time fun(): string "2026-11-21T10:15:03Z"
---@field terminal fun(): { stdin: boolean, stdout: boolean, stderr: boolean, columns: integer,
---color: boolean, color_stderr: boolean } are they terminals that show colours?
---@field line_editor limax.host.line_editor
---@field environment fun(): table<string, string|integer> facts about this machine and build
local host = {}

return host
