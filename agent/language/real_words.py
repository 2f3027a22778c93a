"""Ordinary English words that differ from a word of the lexicon by one slip, and so are no typos of it."""

from robosandbox.agent.language.wordlist import word_set

REAL_WORDS = word_set(
    """
    acre aft agua ajay alla alle alli ally amer amr amt andi andy ara aram areas aren arena ares aria arise arising
    arms army arne arse arte artiste arya atp awa awry baal babe bac bach backhand backs backwoods backyard bae baek
    baer bail bailing bain bak baker bala bald balding bali balm bane bank bare bark barre barred barren bas basel
    bases bash basic basil basing bask bass bate bath battle batty bearer beater beaver beck becker becket bedside
    bee beef beep bees beet bein bell ber beth betty bidding bien bill billing bind binding blacks blank     blinding bloch blown blues blum blur blush bock boer boiling bol booth bose bosh botha bots bottled bottoms bout
    bowel bows brad bravest brawn breaker breeder brice brig brink brisk broadcast broaden broadly broads brock bron
    brood broth brother brow browne browns brows browser buck bucky budding bugger buick buildings bulging bulk bull
    bullies bully bullying bunt burt burundi busiest bust bute butt cabaret cabernet cain cams cane canines cano
    cant canton capable capture carbine carbon carlton carson carte cartoon caster casters cate causing cbe ceasing
    cent cents chan chapter charter chasing chatter cheery chester chocolates choke choking chose chucky chunk
    chunks clan clarinet clashing clemson clipboard clocking clogging cloister cloning closely closet closets
    clothing clotting clouded clove clunky cluster cmos coastal code coe coffey coker cold coldest cole collared
    colluded colo colon coloring comcast company compass compost conjured conner conor contain contained contains
    conti cooke cooking coolest cooling coordinate coordinated coordinator coordinators cope core cornea corners
    cornet coroner costing cote coulda couldn coulter coup coupe coupled couples cove cpu crane crater crave craze
    creams creamy crete crimean crossing cuba cue cultured curate cure cursing cusp cute dag dash dawn decimated dei
    diced dick died diem diet dieu digging dike dime dine dipping dire dis disband diss dissent dist distaste
    distinct distort distract dive doin don dow dowd downs dozens drab drafting draining drank draper drax dredging
    drinks drip dripping drm drooling droppings drown drowning drunk dum dustin dusting easement edgy edie
    eighteenth eighties elegant elemental eleventh emeralds emerged emery enchanting endo enid enormously esmeralda
    est etch evers ewe exchanger extremely extremes fact faintest fair fairest fait fare farm farr fastest fate fats
    fave fear feat fee fees felt fencing fest fiat fide fife fifteenth fifties firs firsts fist fitch fittest fives
    fla flack flag flak flank flap flash flats flaw flax fleet flew float flour font foo food fool foote footy foray
    forearm forearms foreword fort forte forth forts forwarded foul fours fourteenth fra frat fret fro frog fronts
    frost fta fur gab garage garages garb gary gasp gasping gay gearing gent gettin giants gifting glassy gloss goin
    goings golds golf gong gould grading grady grafting grant granting grappling gras grating gravy grays grazing
    gre greater greatness greats greaves greed greek greene greening greens greenwich greer greeting greg greta grew
    greys grinder groping grossing grub gutting hale hall halo halting handel handled handler hap harding harper
    heal helping hemp hep herding highness highs hindered hoarding hoe hol hola holdings holed holm holo holt holy
    hom homer homey homie homme homo homs hone honing honking honored hood hooking hope hopping hosting houdini
    housing hove howe howling huddled hue hugo hugs hunched hundreds hundredth ibn ich ide inc inca incl indo info
    int intl intro itch itt ivor lactation lager lago lame lang lange largely largo lasting launder lefties leftist
    leftists lefty leg legs leno lent leo leon lest leto lice licking lido lied lighting lila lim lima limb limes
    limiting limo limp limping lind ling linger linking lint lire lise listing listings lit lite live lng locator
    log logo lon lone loner longed longs looting loser loudest lounges lover lowe lows lung lyme magneto maid mail
    male males malt mani marion marlon maroons mart massage massimo massively mast mata mater math matt maude mcs
    meat meddle mediums meier ment mere meteor meteors metro meyer meyers mice midi mike miki mila mild miley milf
    milfs mill mille mills milne milo milos mime mimi mines miniatures minis mints mire missile mit mite mites mitt
    mixes moat mode moe moist moles moms moot mort mos moss mot mott mov mover movie mowing msm mst mta muddle mule
    mules mums myles nagging narrowed narrowly narrows nav nave navi nay neat ned nene nest net newt niches nie nike
    nile nin nina nines nineteenth nineties ning nino nite nodding noe none note nots nude numbers numbing nursing
    obeying oder offs oliver olives omen omer ono ons onus opec opel openings oranges ores otto oust outs ove overs
    overt owen owes oxen pace pacing pact pai paid pain pairing palace palate panicking pant panting par para parc
    pare pari parr pars parte parti parting parts party past pate paul pausing pda pease peck pecking peeking
    peeling peering peking pele pershing petit petition petitioning petting phasing phil phishing pic pickering
    picky pico pics pie pieced pilar pilate pinching ping pining pinks pinky pinning pins pint piping pissing
    pitching pitting placer planing planning plat plata plated plating plato platt platte playing pleading pleas
    pleased pleases pleasing plotting plowing plush poaching pock poe pointe points pointy poker policing polling
    pont pooping poor pope por pore port portico portions portman posh posing positional positive postponing
    posturing potion potions pounding pout powering praising praying prepping pres presiding presse pressuring
    presuming preying pricing prick processing procuring pruning pugh puke puking pulp pulsing punching punishing
    punk punt pur purging pursuing pus pushy puss putt puzzling pyle pyramidal quakers quarrel quarrels quartered
    quarterly quartet quieter racking rae rafting raiding railing railings raining raiser raisin raisins ram ramming
    ramping ranging ranking ranting rapping realising recalling recurring recycled redd redding reds reed regions
    rehearse rehearsing reid relapse relating relaxing relaying reloading repealing repeating retaining retiring
    revealing reverse reversing revising rights rise rising risking rob robe robots rode roe role rome root ros rosa
    rosen roses rosh rosie ross rosy rote rouse rousing rove rowe rub rubbing rubs rudy rugby ruining ruse sack
    sacking sade sailing salim salman salmond salomon salon saloon sampler sap sauce sauces scammer scarier scariest
    scarlett scarred scarves scooter scoping scoring scot scouting scrapping sealing searing seat seating seconds
    sect seeking seeming seen seething selling semen sender senegal sensing sept serenity seth settings sevens
    seventeenth seventies sever severed severely severity severn severus sexting shack shade shading shaft shaking
    shale shame shaming shane shaped shaping sharing sharpe sharper sharpest shat shatter shaving shelter shelving
    shifter shifty shilling shimmer shingle shining shit shocker shocking shone shooter shooters shopper shopping
    shortage shortcut shorten shortlist shortly shortness shorts shorty shot shout shouted shouting shovel shoveling
    showing showings shu shui shun shunt shutter sid sided sides siding sie sift sifting silencer silvers silvery
    sim simmer sine singled singles sipping sire site sited sixteenth sixties sizeable sizes sketching skim skimmed
    skipping skirting slack slacking slade slam slammed slander slapping slaying sleeper slicing slider slime
    slimming slimy slipper slit sliver sloping slowing slum slumber slut smack smacking smalls smelled smelter
    smelting smiling smoking smut snack snacking snape snapping sniffing sniping snitch snoring snort snorted
    snorting snot snowing snuff soa soaking soaring sobbing sod sodas soft softest solver solving soma sona soothing
    sor sore sorta sosa sourcing spacing spanking sparking spat spencer spender spiking spit spitting splendor
    splicing sporting spotter spout spouting squad squats squatting srt stabbing stacy staff staffing staging
    staining staking stalk stalker stalking stall stalled stalling stank staring stark starling starring starter
    starving stating staying ste stepping steven stiff stifling stinking stitch stitching stock stocking stockings
    stoning stoppage stopping storming stove strange strapping striking stroking stuffy sucking suitable surfing
    surging sven swab swag swam swamp swan swarming swat swatch sway swaying sweating swift swimmer swimmers swiping
    tabled tables tae tagging tail taka taker tale talker talking tallies tally tame taming tana tang tank tanning
    tapering taping tarp tasking tasting tat tate taxing tay teaching teak team teen teens tel teller tem tend tenn
    tens tent tha thad thai thane thang thats thaw thea thee theme theo thicke thickens thickness thine thinly
    thirds thirsty thirteenth thirties thom thong though thrash threes threw through thunder tick ticker ticking
    tide tidings till tiller tilting tina tinder ting tinker tint tion tna toby toll toner tony topping toppings
    tops torch tory touchy tough touring touting tow towed tra tracker tracy trad tram tran transform transforming
    trap trapping trappings trashy trey trick tricked trickery trickier tripping trish troy trucker trucking tuba
    tue tumble tumbled tumblr tune twat twin twos tying upped violent violets wade wasted wastes wastewater weed
    week weep weve whine whit whiter whites whitey whyte widen width wie wife wilde wilder wildest wiper wiser
    wisest wit witch wits witt wooded world woulda wouldn wound wto yar yarn yarns yellows youd youre yours yous
    zeros
    """
)
