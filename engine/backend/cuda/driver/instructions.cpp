// instructions.cpp: counts the instructions of a function in a binary (ELF, 64 bits).
#include <elf.h>

#include <cstring>

#include "backend/cuda/driver/kernel.h"

namespace limax::cuda {

namespace {

constexpr std::size_t instruction_size = 16;  // bytes, since compute capability 7.0
// The operation is in the lowest 12 bits of an instruction.
constexpr unsigned operation_mask = 0xfff, operation_nop = 0x918;

template <class T>
T read_at(std::string_view bytes, std::size_t offset) {
    T out;
    std::memcpy(&out, bytes.substr(offset, sizeof out).data(), sizeof out);
    return out;
}

}  // namespace

std::size_t instruction_count(std::string_view binary, std::string_view function) {
    if (binary.substr(0, SELFMAG) != ELFMAG) return 0;
    const auto head = read_at<Elf64_Ehdr>(binary, 0);
    const auto section = [&](std::size_t index) {
        return read_at<Elf64_Shdr>(binary, head.e_shoff + index * sizeof(Elf64_Shdr));
    };
    const std::string_view names = binary.substr(section(head.e_shstrndx).sh_offset);
    for (std::size_t index = 0; index < head.e_shnum; ++index) {
        const Elf64_Shdr at = section(index);
        const std::string_view name = names.substr(at.sh_name);
        if (name.substr(0, name.find('\0')) != ".text." + std::string(function)) continue;
        const std::string_view code = binary.substr(at.sh_offset, at.sh_size);
        std::size_t count = code.size() / instruction_size;
        const auto is_padding = [&](std::size_t i) {
            return (read_at<uint16_t>(code, i * instruction_size) & operation_mask) ==
                   operation_nop;
        };
        while (count > 0 && is_padding(count - 1)) --count;
        return count;
    }
    return 0;
}

}  // namespace limax::cuda
