--- robots.lua: the section of robots.

local robots = {}

function robots.section() return { body = "", scripts = {}, notices = "" } end

return robots
