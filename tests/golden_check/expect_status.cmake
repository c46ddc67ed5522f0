# Runs golden_check over files with faults and compares its exit status.
#   cmake -DPROGRAM=<golden_check> -DFOLDER=<scratch folder> -P expect_status.cmake
set(header "id,label,f32,alpha_x,alpha_y,r,status,s,s_le_r,radius_paper_even,radius_plane,radius_guaranteed")
set(good "0,random,0,0.7853981633974483,0.7853981633974483,2.0,ok,1.0,1,4.0,3.1622776601683795,4.1815405503520555")

# expect(<case> <status> <name> <text>): a folder with one file of that name.
function(expect case status name text)
    file(REMOVE_RECURSE "${FOLDER}/${case}")
    file(WRITE "${FOLDER}/${case}/${name}" "${text}")
    execute_process(
        COMMAND "${PROGRAM}" "${FOLDER}/${case}" RESULT_VARIABLE result OUTPUT_VARIABLE output
        ERROR_VARIABLE output
    )
    if(NOT result EQUAL status)
        message(SEND_ERROR "${case}: exit status ${result}, expected ${status}\n${output}")
    endif()
endfunction()

expect(good 0 star_shape.csv "${header}\n${good}\n")
string(REPLACE "4.18154" "4.18155" wrong "${good}")
expect(wrong_value 1 star_shape.csv "${header}\n${wrong}\n")
string(REPLACE ",ok," ",err_fov," wrong "${good}")
expect(wrong_outcome 1 star_shape.csv "${header}\n${wrong}\n")
expect(missing_cell 2 star_shape.csv "${header}\n${good},1\n")
string(REPLACE ",2.0," ",two," wrong "${good}")
expect(no_number 2 star_shape.csv "${header}\n${wrong}\n")
string(REPLACE ",ok," ",fine," wrong "${good}")
expect(unknown_outcome 2 star_shape.csv "${header}\n${wrong}\n")
string(REPLACE "alpha_y" "beta" wrong "${header}")
expect(missing_column 2 star_shape.csv "${wrong}\n${good}\n")
expect(no_rows 2 star_shape.csv "${header}\n")
expect(unknown_file 2 moon_shape.csv "${header}\n${good}\n")
execute_process(
    COMMAND "${PROGRAM}" "${FOLDER}/nowhere" RESULT_VARIABLE result OUTPUT_QUIET ERROR_QUIET
)
if(NOT result EQUAL 2)
    message(SEND_ERROR "a missing folder: exit status ${result}, expected 2")
endif()
