# kernels.cmake: finds the CUDA Toolkit, compiles the kernels of ahead_of_time.txt for the GPUs of this
# machine, and embeds them and the texts that NVRTC compiles at run time. Included by CMakeLists.txt.
# It sets
#   LIMAX_CUDA_COMPILER   nvcc, or empty
#   LIMAX_WITH_CUDA       whether the CUDA engine is built
#   LIMAX_CUDA_INCLUDE    folder of cuda.h and nvrtc.h
#   LIMAX_CUDA_SOURCES    generated sources with the embedded files
#   LIMAX_KERNEL_OPTIONS  options of nvcc and NVRTC
#   LIMAX_NVRTC_FOLDER    folder of NVRTC in the toolkit, or empty
# No CUDA library is linked: the driver and NVRTC are opened at run time.

set(LIMAX_CUDA_ARCHITECTURES "" CACHE STRING
    "Compute capabilities to compile kernels for ahead of time, such as 80;90; empty: those of this machine's GPUs")

# Texts that a kernel may include, by their names below engine/. They include only each other.
set(LIMAX_LAW_TEXTS
    base/portable.h base/math.h base/random.h
    body/lattice.h body/body_laws.h body/spring_laws.h
    genome/network.h genome/breeding.h genome/gene_sums.h
    physics/integrator.h physics/bound.h physics/body_frame.h physics/drive.h physics/sensors.h physics/held.h physics/origin.h physics/rigid_body.h physics/separation.h physics/solid.h physics/solid_edges.h physics/solid_pairs.h physics/summary.h
    physics/scripted/operations.h)
set(LIMAX_LAW_FOLDERS physics/effects backend/cuda/kernels)

# Options of both nvcc and NVRTC: the compiler adds no rounding and removes none.
set(LIMAX_KERNEL_OPTIONS --std=c++20 --fmad=false --ftz=false --prec-div=true --prec-sqrt=true)

# ---- the toolkit ----

set(LIMAX_CUDA_COMPILER "")
set(LIMAX_WITH_CUDA OFF)
set(LIMAX_CUDA_SOURCES "")

# Reports why there is no CUDA engine; an error if LIMAX_CUDA=ON.
function(refuse_cuda reason)
    if(LIMAX_CUDA STREQUAL "ON")
        message(FATAL_ERROR "LIMAX_CUDA=ON, but ${reason}")
    endif()
    message(STATUS "No CUDA engine: ${reason}")
endfunction()

if(LIMAX_CUDA STREQUAL "OFF")
    message(STATUS "No CUDA engine: LIMAX_CUDA=OFF")
    return()
endif()
find_program(LIMAX_NVCC nvcc HINTS /usr/local/cuda/bin)
if(NOT LIMAX_NVCC)
    refuse_cuda("nvcc was not found. It comes with the CUDA Toolkit 12 or 13")
    return()
endif()
set(LIMAX_CUDA_COMPILER "${LIMAX_NVCC}")

execute_process(COMMAND ${LIMAX_NVCC} --version OUTPUT_VARIABLE nvcc_says ERROR_VARIABLE nvcc_says)
if(NOT nvcc_says MATCHES "release ([0-9]+)\\.([0-9]+)" OR CMAKE_MATCH_1 LESS 12)
    refuse_cuda("${LIMAX_NVCC} is not of the CUDA Toolkit 12 or newer")
    return()
endif()
set(nvcc_version "${CMAKE_MATCH_1}.${CMAKE_MATCH_2}")

# nvcc may be a link or a wrapper, so it is asked for the folder of its toolkit
set(trial "${CMAKE_CURRENT_BINARY_DIR}/kernels/trial")
file(WRITE "${trial}.cu" "#include <cmath>\n#include <cstdint>\n#include <cstring>\n__global__ void trial() {}\n")
execute_process(COMMAND ${LIMAX_NVCC} --dryrun -cubin -o ${trial}.cubin ${trial}.cu
    OUTPUT_VARIABLE nvcc_says ERROR_VARIABLE nvcc_says)
if(nvcc_says MATCHES "TOP=([^\n]+)")
    file(REAL_PATH "${CMAKE_MATCH_1}" toolkit)
else()
    file(REAL_PATH "${LIMAX_NVCC}" toolkit)
    get_filename_component(toolkit "${toolkit}/../.." ABSOLUTE)
endif()
file(GLOB toolkit_targets "${toolkit}/targets/${CMAKE_SYSTEM_PROCESSOR}-linux" "${toolkit}/targets/*-linux")
set(toolkit_include_hints "${toolkit}/include")
set(toolkit_library_hints "${toolkit}/lib64")
foreach(target ${toolkit_targets})
    list(APPEND toolkit_include_hints "${target}/include")
    list(APPEND toolkit_library_hints "${target}/lib")
endforeach()
find_path(LIMAX_CUDA_INCLUDE nvrtc.h HINTS ${toolkit_include_hints})
if(NOT LIMAX_CUDA_INCLUDE OR NOT EXISTS "${LIMAX_CUDA_INCLUDE}/cuda.h")
    refuse_cuda("cuda.h and nvrtc.h were not found beside ${LIMAX_NVCC}")
    return()
endif()
# at run time NVRTC is also searched here, after the places of the loader
find_path(LIMAX_NVRTC_FOLDER NAMES libnvrtc.so.13 libnvrtc.so.12 HINTS ${toolkit_library_hints})
if(NOT LIMAX_NVRTC_FOLDER)
    set(LIMAX_NVRTC_FOLDER "")
endif()

# The capabilities that this nvcc supports, and those to compile kernels for.
execute_process(COMMAND ${LIMAX_NVCC} --list-gpu-code OUTPUT_VARIABLE nvcc_codes ERROR_QUIET)
string(REGEX MATCHALL "sm_[0-9]+" nvcc_codes "${nvcc_codes}")
set(nvcc_capabilities "")
foreach(code ${nvcc_codes})
    string(SUBSTRING ${code} 3 -1 capability)
    if(capability GREATER_EQUAL 75)
        list(APPEND nvcc_capabilities ${capability})
    endif()
endforeach()
list(SORT nvcc_capabilities COMPARE NATURAL)
set(capabilities ${LIMAX_CUDA_ARCHITECTURES})
if(NOT capabilities)
    execute_process(COMMAND nvidia-smi --query-gpu=compute_cap --format=csv,noheader
        OUTPUT_VARIABLE found_gpus ERROR_QUIET RESULT_VARIABLE smi_result TIMEOUT 30)
    string(REGEX MATCHALL "[0-9]+\\.[0-9]" found_gpus "${found_gpus}")
    foreach(gpu ${found_gpus})
        string(REPLACE "." "" capability ${gpu})
        # kernels for GPUs that this nvcc does not know are compiled by NVRTC at their first use
        if(capability IN_LIST nvcc_capabilities)
            list(APPEND capabilities ${capability})
        endif()
    endforeach()
endif()
list(REMOVE_DUPLICATES capabilities)
list(SORT capabilities COMPARE NATURAL)
foreach(capability ${capabilities})
    if(NOT capability IN_LIST nvcc_capabilities)
        list(JOIN nvcc_capabilities " " supported)
        message(FATAL_ERROR "LIMAX_CUDA_ARCHITECTURES names ${capability}; this nvcc supports ${supported}")
    endif()
endforeach()
if(NOT nvcc_capabilities)
    refuse_cuda("${LIMAX_NVCC} names no architecture from 7.5 up")
    return()
endif()

# Whether nvcc works, with the host compiler of this build or else with its own choice.
list(GET nvcc_capabilities 0 first_capability)
set(nvcc_works FALSE)
foreach(host_compiler "-ccbin=${CMAKE_CXX_COMPILER}" "")
    set(LIMAX_NVCC_COMMAND ${LIMAX_NVCC} ${host_compiler} ${LIMAX_KERNEL_OPTIONS})
    execute_process(COMMAND ${LIMAX_NVCC_COMMAND} -arch=sm_${first_capability} -cubin -o ${trial}.cubin ${trial}.cu
        RESULT_VARIABLE trial_failed OUTPUT_VARIABLE trial_says ERROR_VARIABLE trial_says)
    if(NOT trial_failed)
        set(nvcc_works TRUE)
        break()
    endif()
endforeach()
if(NOT nvcc_works)
    string(STRIP "${trial_says}" trial_says)
    refuse_cuda("${LIMAX_NVCC} does not compile a trial kernel:\n${trial_says}")
    return()
endif()
set(LIMAX_WITH_CUDA ON)
enable_language(ASM)
if(capabilities)
    list(JOIN capabilities " " capabilities_text)
    message(STATUS "CUDA engine: nvcc ${nvcc_version}, kernels for compute capability ${capabilities_text} and later")
else()
    message(STATUS "CUDA engine: nvcc ${nvcc_version}; no GPU here, so kernels are compiled at their first use")
endif()

# ---- embedding: an assembly file includes the files, a table lists them ----

set(embedded_assembly "${CMAKE_CURRENT_BINARY_DIR}/generated/embedded.S")
set(embedded_table "${CMAKE_CURRENT_BINARY_DIR}/generated/embedded.cpp")
set(embedded_files "")     # included by the assembly file
set(assembly_text "")
set(declarations_text "")
set(headers_text "")
set(sets_text "")
set(binaries_text "")

# Embeds a file, followed by a zero, between `symbol` and `symbol`_end.
function(embed path symbol)
    set(embedded_files "${embedded_files};${path}" PARENT_SCOPE)
    string(CONCAT assembly_text "${assembly_text}"
        "    .balign 16\n    .globl ${symbol}, ${symbol}_end\n    .hidden ${symbol}, ${symbol}_end\n"
        "${symbol}:\n    .incbin \"${path}\"\n${symbol}_end:\n    .byte 0\n")
    set(assembly_text "${assembly_text}" PARENT_SCOPE)
    set(declarations_text "${declarations_text}extern const char ${symbol}[], ${symbol}_end[];\n" PARENT_SCOPE)
endfunction()

# Adds the binary of the kernel `name` for an architecture.
macro(embed_kernel path architecture)
    string(MAKE_C_IDENTIFIER "limax_kernel_${name}_${architecture}" symbol)
    embed("${path}" ${symbol})
    string(APPEND binaries_text
        "        {\"${entry} ${defines}\", \"${architecture}\", bytes(${symbol}, ${symbol}_end)},\n")
endmacro()

set(engine_folder "${CMAKE_CURRENT_SOURCE_DIR}/engine")
set(texts ${LIMAX_LAW_TEXTS})
foreach(folder ${LIMAX_LAW_FOLDERS})
    file(GLOB found RELATIVE "${engine_folder}" CONFIGURE_DEPENDS "${engine_folder}/${folder}/*.h")
    list(APPEND texts ${found})
endforeach()
foreach(text ${texts})
    string(MAKE_C_IDENTIFIER "limax_text_${text}" symbol)
    embed("${engine_folder}/${text}" ${symbol})
    string(APPEND headers_text "        {\"${text}\", ${symbol}},\n")
endforeach()

# ---- kernels compiled ahead of time: a line of the list gives a name, an entry and its defines ----

set(kernel_list "${CMAKE_CURRENT_SOURCE_DIR}/engine/backend/cuda/ahead_of_time.txt")
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS "${kernel_list}")
file(STRINGS "${kernel_list}" lines REGEX "^[^#]")
set(names "")
foreach(line ${lines})
    separate_arguments(words UNIX_COMMAND "${line}")
    list(POP_FRONT words name entry)
    if(NOT entry OR NOT EXISTS "${engine_folder}/backend/cuda/kernels/${entry}.h" OR name IN_LIST names)
        message(FATAL_ERROR "${kernel_list}: '${line}' must be a new name, a file of kernels/ without its .h, "
            "and NAME=VALUE for each define")
    endif()
    list(APPEND names ${name})
    set(source_text "")
    foreach(define ${words})
        if(NOT define MATCHES "^([A-Za-z_][A-Za-z_0-9]*)=([^ \"\\]*)$")
            message(FATAL_ERROR "${kernel_list}: '${define}' of '${name}' is not NAME=VALUE")
        endif()
        string(APPEND source_text "#define ${CMAKE_MATCH_1} ${CMAKE_MATCH_2}\n")
    endforeach()
    string(APPEND source_text "#include \"backend/cuda/kernels/${entry}.h\"\n")
    set(source "${CMAKE_CURRENT_BINARY_DIR}/kernels/${name}.cu")
    file(CONFIGURE OUTPUT "${source}" CONTENT "${source_text}" @ONLY)
    list(JOIN words " " defines)
    string(APPEND sets_text "        \"${entry} ${defines}\",\n")
    # of each architecture machine code, and of the oldest also the PTX, which later GPUs compile
    set(oldest TRUE)
    foreach(capability ${capabilities})
        set(stem "${CMAKE_CURRENT_BINARY_DIR}/kernels/${name}.${capability}")
        add_custom_command(OUTPUT "${stem}.ptx" "${stem}.cubin"
            COMMAND ${LIMAX_NVCC_COMMAND} -arch=compute_${capability} -ptx -I "${engine_folder}"
                -MD -MF "${stem}.d" -MT "${stem}.ptx" -o "${stem}.ptx" "${source}"
            COMMAND ${LIMAX_NVCC_COMMAND} -arch=sm_${capability} -cubin -o "${stem}.cubin" "${stem}.ptx"
            DEPENDS "${source}" DEPFILE "${stem}.d" VERBATIM
            COMMENT "Compiling kernel ${name} for sm_${capability}")
        embed_kernel("${stem}.cubin" sm_${capability})
        if(oldest)
            embed_kernel("${stem}.ptx" compute_${capability})
            set(oldest FALSE)
        endif()
    endforeach()
endforeach()

file(CONFIGURE OUTPUT "${embedded_assembly}" @ONLY CONTENT
"    .section .rodata
@assembly_text@    .section .note.GNU-stack,\"\",%progbits
")
file(CONFIGURE OUTPUT "${embedded_table}" @ONLY CONTENT
"// Generated by kernels.cmake: the names of what embedded.S contains.
#include \"backend/cuda/driver/kernel.h\"

extern \"C\" {
@declarations_text@}

namespace limax::cuda {

const std::vector<header>& kernel_headers() {
    static const std::vector<header> list = {
@headers_text@    };
    return list;
}

const std::vector<const char*>& embedded_sets() {
    static const std::vector<const char*> list = {
@sets_text@    };
    return list;
}

const std::vector<embedded_binary>& embedded_binaries() {
    [[maybe_unused]] const auto bytes = [](const char* begin, const char* end) {
        return std::string_view(begin, std::size_t(end - begin));
    };
    static const std::vector<embedded_binary> list = {
@binaries_text@    };
    return list;
}

}  // namespace limax::cuda
")
set_source_files_properties("${embedded_assembly}" PROPERTIES OBJECT_DEPENDS "${embedded_files}")
set(LIMAX_CUDA_SOURCES "${embedded_assembly}" "${embedded_table}")
