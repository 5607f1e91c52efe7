// instructions.cpp: counts the instructions of a function in a binary (ELF, 64 bits). Every offset
// is checked: the bytes may be anything.
#include <elf.h>

#include <cstring>

#include "backend/cuda/driver/kernel.h"

namespace limax::cuda {

namespace {

constexpr int machine_cuda = 190;             // e_machine of NVIDIA's binaries
constexpr std::size_t instruction_size = 16;  // bytes, since compute capability 7.0
// The operation is in the lowest 12 bits of an instruction.
constexpr unsigned operation_mask = 0xfff, operation_nop = 0x918;

// A copy of the T at `offset`; false if the bytes end before.
template <class T>
bool read_at(std::string_view bytes, std::size_t offset, T& out) {
    if (offset > bytes.size() || bytes.size() - offset < sizeof out) return false;
    std::memcpy(&out, bytes.data() + offset, sizeof out);
    return true;
}

std::string_view part(std::string_view bytes, std::size_t offset, std::size_t size) {
    if (offset > bytes.size() || bytes.size() - offset < size) return {};
    return bytes.substr(offset, size);
}

bool is_padding(std::string_view code, std::size_t instruction) {
    uint16_t bits = 0;
    return read_at(code, instruction * instruction_size, bits) &&
           (bits & operation_mask) == operation_nop;
}

}  // namespace

std::size_t instruction_count(std::string_view binary, std::string_view function) {
    Elf64_Ehdr head;
    if (!read_at(binary, 0, head) || std::memcmp(head.e_ident, ELFMAG, SELFMAG) != 0 ||
        head.e_ident[EI_CLASS] != ELFCLASS64 || head.e_machine != machine_cuda)
        return 0;
    const auto section = [&](std::size_t index, Elf64_Shdr& out) {
        return index < head.e_shnum && read_at(binary, head.e_shoff + index * sizeof out, out);
    };
    Elf64_Shdr names;
    if (head.e_shentsize != sizeof names || head.e_shoff > binary.size() ||
        !section(head.e_shstrndx, names))
        return 0;
    const std::string_view all_names = part(binary, names.sh_offset, names.sh_size);
    const std::string wanted = ".text." + std::string(function);
    for (std::size_t index = 0; index < head.e_shnum; ++index) {
        Elf64_Shdr at;
        if (!section(index, at)) return 0;
        if (at.sh_type != SHT_PROGBITS || at.sh_name >= all_names.size()) continue;
        const std::string_view name = all_names.substr(at.sh_name);
        if (name.substr(0, name.find('\0')) != wanted) continue;
        const std::string_view code = part(binary, at.sh_offset, at.sh_size);
        std::size_t count = code.size() / instruction_size;
        while (count > 0 && is_padding(code, count - 1)) --count;
        return count;
    }
    return 0;
}

}  // namespace limax::cuda
