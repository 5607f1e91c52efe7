--- user_folder.lua: where limax keeps files of this user, as the XDG Base Directory Specification
--- asks. Relative paths are ignored: files in the working folder may be somebody else's.

local BELOW_HOME = { XDG_CONFIG_HOME = "/.config", XDG_STATE_HOME = "/.local/state" }

local function absolute(variable)
  local path = os.getenv(variable)
  return path and path:sub(1, 1) == "/" and path or nil
end

--- The folder of limax's files of a kind; nil and a message if the user has none.
---@param variable "XDG_CONFIG_HOME"|"XDG_STATE_HOME"
return function(variable)
  local folder, home = absolute(variable), absolute "HOME"
  if not folder and not home then
    return nil, ("neither $%s nor $HOME is an absolute path"):format(variable)
  end
  return (folder or home .. BELOW_HOME[variable]) .. "/limax"
end
